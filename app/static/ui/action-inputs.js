// The fields that an action's form is made of.

import { el } from "./dom.js";

export const AXES = ["x", "y", "z"];
export const DIRECTIONS = ["x+", "x-", "y+", "y-", "z+", "z-"];

let ids = 0;

export function field(label, input) {
    ids += 1;
    input.id = `action-field-${ids}`;
    return el("div", { class: "field" }, el("label", { for: input.id, text: label }), input);
}

/** `value` may be null only where the field may stay empty (`required` is false). */
export function numberInput(name, value, min, max, { step = "any", required = true } = {}) {
    const shown = Number.isFinite(value) ? String(Number(value.toFixed(2))) : "";
    return el("input", { type: "number", name, value: shown, min, max, step, required });
}

export function select(name, options, value) {
    return el(
        "select",
        { name },
        ...options.map(([key, text]) =>
            el("option", { value: key, text, selected: String(key) === String(value) }),
        ),
    );
}

/** The straight direction and speed of a Cartesian jog; null when it is not along one axis. */
export function straightOf(action) {
    const linear = action.linear || [0, 0, 0];
    if ((action.angular || []).some(Boolean)) return null;
    const moving = linear.map((speed, axis) => [speed, axis]).filter(([speed]) => speed);
    if (moving.length !== 1) return null;
    const [speed, axis] = moving[0];
    return { direction: AXES[axis] + (speed > 0 ? "+" : "-"), speed: Math.abs(speed) };
}

/** Which of the form's kinds an action is. */
export function kindOf(action) {
    if (action.type !== "jog_cartesian") return action.type;
    return straightOf(action) ? "straight" : "exact";
}
