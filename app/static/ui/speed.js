// How fast the arm moves: a slider, and a button for fine work.

import { texts } from "../texts/texts.js";
import { button, el, setText, want } from "./dom.js";
import { isDriving } from "./page.js";
import { percent, short } from "./words.js";

export const FINE = 0.2; // of the ordinary speed
export const SLOWEST = 0.05;

/** Part of the ordinary speed that is wanted now. */
export const speedOf = ({ speed, fine }) => (fine ? Math.min(FINE, speed) : speed);

/** A remembered speed as a number that the slider can show; 1 for anything else. */
export function knownSpeed(text) {
    const value = Number(text);
    return text !== null && value >= SLOWEST && value <= 1 ? value : 1;
}

/**
 * What is remembered of the speed, {speed, fine}, as far as it may come into force by itself: never
 * faster than now while this page drives.
 */
export function safeSpeed(state, memory) {
    const wanted = { speed: knownSpeed(memory.get("speed")), fine: memory.get("fine") === "yes" };
    return isDriving(state) && speedOf(wanted) > speedOf(state) ? state : wanted;
}

export function speed(element, store) {
    const words = texts.speed;
    const slider = el("input", {
        type: "range",
        id: "speed",
        min: SLOWEST * 100,
        max: 100,
        step: 5,
        oninput: () => want(element, "speed", { speed: Number(slider.value) / 100 }),
    });
    const value = el("output", { id: "speed-value", for: "speed" });
    const fine = button(words.fine, {
        id: "fine",
        "aria-keyshortcuts": "F",
        title: words.fineHint,
        onclick: () => want(element, "toggle-fine"),
    });
    element.append(el("label", { for: "speed", text: words.label }), slider, value, fine);

    store.watch(["connection", "hello", "robot", "speed", "fine"], (state) => {
        element.hidden = !isDriving(state);
        const wanted = String(Math.round(speedOf(state) * 100));
        if (slider.value !== wanted) slider.value = wanted;
        const shown = percent(speedOf(state), short);
        setText(value, shown);
        slider.setAttribute("aria-valuetext", shown);
        fine.setAttribute("aria-pressed", String(state.fine));
    });
}
