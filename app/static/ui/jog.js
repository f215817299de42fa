// Driving without a hand in the picture: buttons, keys and a gamepad, each for as long as it is held.

import { texts } from "../texts/texts.js";
import { el, setText } from "./dom.js";
import { movesOf } from "./moves.js";
import { describeAction, jointName } from "./words.js";

const words = texts.jog;
const TURN_KEYS = { "+": 1, "=": 1, "-": -1, "_": -1 };
const PAD = "gamepad";

/** What somebody must press, as "Shift+ArrowUp". */
const chord = ({ key, shiftKey }) => (shiftKey ? `Shift+${key}` : key);

/** Key names as they stand on keyboards: "⇧ ↑". */
const keyWords = (key) => key.split("+").map((each) => words.keys[each] || each).join(" ");

/**
 * Fills `element`. `held` is told what is pressed, `mayPress()` says whether keys count now. Returns
 * {down(event), up(event)}, which say whether a key was meant for here, and `pad(wanted)` for what a
 * gamepad asks for.
 */
export function jogPad(element, store, { held, mayPress, stop }) {
    let moves = new Map();
    let shown = "";
    let joint = 1;
    const picked = el("p", { class: "quiet", "aria-live": "polite" });

    function holdButton(move) {
        const release = () => held.release(move.id);
        const press = () => held.press(move.id, move);
        const inside = el(
            "button",
            {
                type: "button",
                class: "jog",
                "aria-pressed": "false",
                "aria-keyshortcuts": move.key || null,
                title: describeAction(move.action, store.state.description),
                data: { move: move.id },
                onpointerdown: (event) => {
                    if (event.button !== 0) return;
                    inside.setPointerCapture(event.pointerId);
                    press();
                },
                onpointerup: release,
                onpointercancel: release,
                onlostpointercapture: release,
                oncontextmenu: (event) => event.preventDefault(), // a long touch is no wish for it
                onkeydown: (event) => {
                    if (event.key === "Enter" && !event.repeat) press();
                },
                onkeyup: (event) => {
                    if (event.key === "Enter") release();
                },
                onblur: release,
            },
            el("span", { class: "label", text: move.label }),
            move.key ? el("kbd", { "aria-hidden": "true", text: keyWords(move.key) }) : null,
        );
        return inside;
    }

    function group(name, list, note = null) {
        if (!list.length) return null;
        return el(
            "fieldset",
            { class: `jog-group jog-${name}` },
            el("legend", { text: words.groups[name] }),
            note,
            el("div", { class: "jog-buttons" }, ...list.map(holdButton)),
        );
    }

    function draw({ description, gestures }) {
        const groups = movesOf(description, gestures);
        const all = Object.values(groups).flat();
        const key = JSON.stringify(all);
        if (key === shown) return;
        shown = key;
        held.release();
        moves = new Map(all.map((move) => [move.id, move]));
        element.replaceChildren(
            el("p", { class: "quiet", text: words.how }),
            ...Object.entries(groups)
                .map(([name, list]) => group(name, list, name === "joint" ? picked : null))
                .filter(Boolean),
            el("p", { class: "quiet", text: words.gamepad }),
        );
        tellJoint();
    }

    function tellJoint() {
        const known = [...moves.values()].find((move) => move.joint === joint);
        setText(picked, known ? words.picked(jointName(joint)) : "");
    }

    function moveOf(event) {
        const wanted = chord(event).toLowerCase();
        const move = [...moves.values()].find(({ key }) => key && key.toLowerCase() === wanted);
        if (move) return move;
        const sign = TURN_KEYS[event.key];
        return sign && moves.get(`joint-${joint}${sign < 0 ? "-" : "+"}`);
    }

    store.watch(["description", "gestures"], draw);
    held.addEventListener("change", () => {
        for (const each of element.querySelectorAll("[data-move]")) {
            each.setAttribute("aria-pressed", String(each.dataset.move === held.id));
        }
    });

    return {
        down(event) {
            if (!held.isOn || !mayPress()) return false;
            const digit = Number(event.key);
            if (digit >= 1 && moves.has(`joint-${digit}+`)) {
                joint = digit;
                tellJoint();
                return true;
            }
            const move = moveOf(event);
            if (!move) return false;
            if (!event.repeat) held.press(event.code, move);
            return true;
        },
        up(event) {
            held.release(event.code);
        },
        pad(wanted) {
            if (wanted && wanted.stop) stop();
            const move = wanted && mayPress() ? moves.get(wanted.move) : null;
            if (move) held.press(PAD, move, wanted.scale);
            else held.release(PAD);
        },
    };
}
