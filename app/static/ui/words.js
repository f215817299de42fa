// Numbers and actions as people say them.

import { told, toldError, texts } from "../texts/texts.js";

const words = texts.action;
const AXES = ["x", "y", "z"];
const DEGREES = 180 / Math.PI;

/** A number with a real minus sign and without needless zeros. */
export function number(value, digits = 1) {
    if (!Number.isFinite(value)) return "–";
    const text = value.toFixed(digits);
    const zero = Number(text) === 0;
    const signed = (zero ? text.replace("-", "") : text).replace("-", "−");
    return signed.replace(".", texts.numbers.decimal);
}

/** Like number(), but "10" and not "10.0". */
export function short(value, digits = 1) {
    return number(value, digits).replace(/[.,]0+$/, "");
}

export const degrees = (radians) => radians * DEGREES;
export const radians = (value) => value / DEGREES;

/** "12.3°" */
export const angle = (value) => `${number(degrees(value))}°`;

/** "4.2%"; with `form` short(), "4%" and not "4.0%". */
export const percent = (fraction, form = number) => texts.numbers.percent(form(fraction * 100));

/** What the page calls the joint of that number, from 1. */
export const jointName = (number) => texts.readout.joint(number);

/** The server's plain words about this robot, its joints called what the page calls them. */
export function toldOf(text, description) {
    const joints = (description && description.joints) || [];
    const names = joints.map(({ name }, index) => [name, jointName(index + 1)]);
    const plain = String(text || "").replace(/\bjoint (\d+)\b/g, (_, number) => jointName(number));
    return told(names.reduce((said, [name, short]) => said.replaceAll(name, short), plain));
}

function cartesian(action) {
    const frame = action.frame === "tool" ? "tool" : "base";
    const parts = [];
    (action.linear || []).forEach((speed, axis) => {
        if (!speed) return;
        const direction = words.straight[frame][AXES[axis] + (speed > 0 ? "+" : "-")];
        parts.push(words.linear(direction, short(Math.abs(speed) * 100)));
    });
    (action.angular || []).forEach((speed, axis) => {
        if (!speed) return;
        const name = frame === "tool" ? words.toolAxis(AXES[axis]) : AXES[axis];
        parts.push(words.angular(name, short(degrees(speed))));
    });
    return parts.length ? parts.join(", ") : words.stand;
}

function way(action) {
    const frame = action.frame === "tool" ? "tool" : "base";
    const parts = [];
    (action.offset || []).forEach((length, axis) => {
        if (!length) return;
        const direction = words.straight[frame][AXES[axis] + (length > 0 ? "+" : "-")];
        parts.push(words.way(direction, short(Math.abs(length) * 100)));
    });
    (action.rotation || []).forEach((turn, axis) => {
        if (!turn) return;
        const name = frame === "tool" ? words.toolAxis(AXES[axis]) : AXES[axis];
        parts.push(words.turnBy(name, short(degrees(turn))));
    });
    return parts.length ? parts.join(", ") : words.stand;
}

function gripper(action, description) {
    const widest = (description && description.gripper_max) || WIDEST_GRIPPER;
    if (action.width <= 0.001) return words.closed;
    if (action.width >= widest * 0.95) return words.open;
    return words.gripper(short(action.width * 1000));
}

const WIDEST_GRIPPER = 0.08;

/** Whether a joint (from 1) moves in metres: it slides, or drives. */
function slides(joint, description) {
    const known = description && description.joints && description.joints[joint - 1];
    return Boolean(known) && known.unit === "m";
}

function simple(action, description) {
    switch (action && action.type) {
        case "jog_cartesian":
            return cartesian(action);
        case "jog_joint":
            if (slides(action.joint, description)) {
                return words.slideJoint(jointName(action.joint), short(action.velocity * 100));
            }
            return words.jogJoint(jointName(action.joint), short(degrees(action.velocity)));
        case "turn_joint":
            if (slides(action.joint, description)) {
                return words.slideJointBy(jointName(action.joint), short(action.angle * 100));
            }
            return words.turnJoint(jointName(action.joint), short(degrees(action.angle)));
        case "pose":
            return words.pose(action.name);
        case "gripper": {
            const what = gripper(action, description);
            return action.force ? words.force(what, short(action.force)) : what;
        }
        case "move_linear":
            return way(action);
        case "wait":
            return words.wait(short(action.duration));
        case "home":
            return words.home;
        case "stop":
            return words.stop;
        default:
            return words.unknown;
    }
}

/** What an action does, in plain words: "forward 10 cm/s". */
export function describeAction(action, description = null) {
    if (action && Array.isArray(action.steps)) {
        const steps = action.steps.map((step) => describeAction(step, description));
        if (!steps.length) return words.unknown;
        const all = words.sequence(steps[0], steps.length - 1);
        return action.type === "repeat" ? words.repeat(action.times, all) : all;
    }
    const what = simple(action, description);
    return action && action.duration && action.type !== "wait" ? words.lasting(what, short(action.duration)) : what;
}

/** Name of a gallery: the shared one has none of its own. */
export const nameOf = (gallery) => (gallery.shared ? texts.first.whose.shared : gallery.name);

/** An error of the REST interface as one sentence. */
export function describeError(error) {
    if (error.status === 0) return texts.errors.unreachable;
    return toldError(error) || texts.errors.other(error.status);
}
