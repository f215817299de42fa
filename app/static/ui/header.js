// The bar at the top: state of the robot, who drives, connection.

import { texts, told } from "../texts/texts.js";
import { part, setIcon, setText } from "./dom.js";
import { isDriving, modeOf } from "./page.js";

/** State in a word, a colour and a shape. */
export function statePill(element, store) {
    const icon = part(element, "icon");
    const word = part(element, "word");
    store.watch(["connection", "robot"], (state) => {
        const mode = modeOf(state);
        element.dataset.mode = mode;
        setIcon(icon, `mode-${mode}`);
        setText(word, texts.modes[mode]);
    });
}

/** Who drives. */
export function driver(element, store) {
    const words = part(element, "words");
    store.watch(["connection", "hello", "robot", "people"], (state) => {
        const controller = state.robot && state.robot.controller;
        element.hidden = state.connection.state !== "open" || !state.robot;
        element.classList.toggle("is-you", isDriving(state));
        const who = controller ? texts.driver.other(controller) : texts.driver.nobody;
        const { operators = 0, observers = 0 } = state.people || {};
        const others = operators + observers - 1;
        const here = others > 0 ? ` · ${texts.people.watching(others)}` : "";
        setText(words, (isDriving(state) ? texts.driver.you : who) + here);
    });
}

/** Connection to the server. */
export function connection(element, store) {
    const icon = part(element, "icon");
    const words = part(element, "words");

    function draw(state) {
        const { state: name, retryAt } = state.connection;
        element.dataset.state = name;
        setIcon(icon, name === "open" ? "link" : "nolink");
        const text = texts.connection[name] || "";
        const seconds = Math.max(1, Math.ceil(((retryAt || 0) - performance.now()) / 1000));
        setText(words, typeof text === "function" ? text(seconds) : text);
    }

    store.watch(["connection"], draw);
    setInterval(() => {
        if (store.state.connection.state === "waiting") draw(store.state);
    }, 500);
}

const TRY_LATER = 1013; // the close code of a server that has no room, or gave up waiting
const OVERLAY_AFTER_MS = 1200; // a short break is not worth a curtain

/** Says plainly that the server is gone. Leaves the dock with the stop button free, not what is `covered`. */
export function goneOverlay(element, store, build, covered) {
    let timer = 0;
    let shown = "";
    // Nobody is to be led by Tab to what cannot be seen. The landmark itself stays.
    const reachable = (yes) => {
        for (const each of covered.children) each.inert = !yes;
    };
    store.watch(["connection"], ({ connection: link }) => {
        const open = link.state === "open";
        if (open) {
            clearTimeout(timer);
            timer = 0;
            shown = "";
            element.hidden = true;
            reachable(true);
            return;
        }
        // A new try is no news: what is said stays until something comes of it.
        if (link.state === "connecting" && shown) return;
        const away = link.reason && link.code === TRY_LATER ? "away" : "gone";
        const kind = link.state === "signed-out" ? "signedOut" : away;
        const show = () => {
            if (shown === kind) return;
            shown = kind;
            element.replaceChildren(build(kind, told(link.reason)));
            element.hidden = false;
            reachable(false);
        };
        if (kind === "signedOut") show();
        else if (!timer) {
            timer = setTimeout(() => {
                if (store.state.connection.state !== "open") show();
            }, OVERLAY_AFTER_MS);
        } else if (shown) show();
    });
}
