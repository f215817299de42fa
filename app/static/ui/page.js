// The page as a whole: its words, icons, and the classes on the root element that hold its state.

import { language, texts } from "../texts/texts.js";
import { icon, setText } from "./dom.js";

const lookUp = (path) => path.split(".").reduce((level, key) => level && level[key], texts);

/** Fill in what index.html leaves open. */
export function preparePage(document) {
    document.documentElement.lang = language;
    document.title = texts.title;
    for (const element of document.querySelectorAll("[data-text]")) {
        setText(element, lookUp(element.dataset.text));
    }
    for (const place of document.querySelectorAll("[data-icon]")) {
        const drawn = icon(place.dataset.icon);
        if (place.dataset.part) drawn.dataset.part = place.dataset.part;
        place.replaceWith(drawn);
    }
    document.getElementById("help-open").setAttribute("aria-label", texts.actions.help);
}

const MODES = ["disarmed", "armed", "moving", "holding", "stopped", "faulted"];

/** The robot's mode, or "unknown" while nobody tells. */
export function modeOf(state) {
    if (state.connection.state !== "open" || !state.robot) return "unknown";
    if (state.robot.fault) return "faulted";
    return MODES.includes(state.robot.mode) ? state.robot.mode : "unknown";
}

/** Whether this page holds the lease. */
export function isDriving(state) {
    const session = state.hello && state.hello.session;
    return Boolean(
        state.connection.state === "open" && session && state.robot &&
            state.robot.controller === session,
    );
}

/** Whether this page may only watch, and stop. */
export function isObserver(state) {
    return Boolean(state.hello && state.hello.role === "observer");
}

/** Whether pictures of a hand come: a camera or the clip runs. */
export function showsHand({ source }) {
    return source.state === "running" && source.kind !== "keys";
}

/** Keep the root element's classes in step with the store. */
export function keepRootClasses(root, store) {
    let mode = "mode-unknown";
    store.watch(["connection", "hello", "robot", "source", "stopping", "glass"], (state) => {
        const now = `mode-${modeOf(state)}`;
        if (now !== mode) root.classList.replace(mode, now);
        mode = now;
        root.classList.toggle("is-connected", state.connection.state === "open");
        root.classList.toggle("is-driving", isDriving(state));
        root.classList.toggle("is-observer", isObserver(state));
        root.classList.toggle("is-armed", Boolean(state.robot && state.robot.armed));
        root.classList.toggle("has-source", state.source.state === "running");
        root.classList.toggle("has-glass", state.glass && showsHand(state));
        root.classList.toggle("is-stopping", state.stopping === "sending");
    });
}
