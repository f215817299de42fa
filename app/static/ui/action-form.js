// Choosing what a gesture does, without writing JSON.

import { texts } from "../texts/texts.js";
import { AXES, DIRECTIONS, field, kindOf, numberInput, select, straightOf } from "./action-inputs.js";
import { el } from "./dom.js";
import { StepList } from "./step-list.js";
import { degrees, radians } from "./words.js";

const words = texts.actionForm;
const SIMPLE = [
    "straight",
    "move_linear",
    "jog_joint",
    "turn_joint",
    "gripper",
    "pose",
    "home",
    "stop",
    "exact",
];
const MOST_REPEATS = 100;
const STRONGEST = 200;

/**
 * A form for one action. `value()` reads it; `element` goes into the page. Inside a sequence
 * (`inside` is "sequence" or "repeat") jogs ask for how long, one may wait, and there are no
 * sequences; repeats hold no repeats. `touched` says whether
 * anything was changed: an untouched action is not read back, since degrees are shown rounded.
 */
export class ActionForm {
    constructor(action, { description = null, inside = null } = {}) {
        this.description = description;
        this.inside = inside;
        this.action = action || { type: "jog_cartesian", frame: "base", linear: [0.1, 0, 0] };
        const more = { sequence: ["wait", "repeat"], repeat: ["wait"] }[inside] || ["sequence"];
        const kinds = [...SIMPLE, ...more];
        this.kind = select("kind", kinds.map((kind) => [kind, words.kinds[kind]]), kindOf(this.action));
        this.fields = el("div", { class: "fields" });
        this.element = el("div", { class: "action-form" }, field(words.kind, this.kind), this.fields);
        this.touched = false;
        for (const kind of ["input", "change", "click"]) {
            this.element.addEventListener(kind, ({ target }) => {
                if (kind !== "click" || target.closest("button")) this.touched = true;
            });
        }
        this.kind.addEventListener("change", () => this.#draw());
        this.#draw();
    }

    /** Whether every field holds something usable; shows what does not. */
    check() {
        if (this.steps && !this.steps.check()) return false;
        const inputs = [...this.fields.querySelectorAll("input")];
        return inputs.every((input) => input.reportValidity());
    }

    /** Mark the steps whose numbers, from 1, are in the set. */
    mark(numbers) {
        if (this.steps) this.steps.mark(numbers);
    }

    #input(name) {
        return this.fields.querySelector(`[name="${name}"]`);
    }

    #number(name) {
        return Number(this.#input(name).value);
    }

    #draw() {
        this.steps = null;
        const kind = this.kind.value;
        const action = kindOf(this.action) === kind ? this.action : {};
        const rows = this[`draw_${kind}`] ? this[`draw_${kind}`](action) : [];
        if (this.inside && ["straight", "exact", "jog_joint"].includes(kind)) {
            rows.push(field(words.duration, numberInput("duration", action.duration || 1, 0.1, 60)));
        }
        this.fields.replaceChildren(...rows);
    }

    draw_straight(action) {
        const { direction, speed } = straightOf(action) || { direction: "x+", speed: 0.1 };
        const frame = action.frame || "base";
        const directions = select("direction", [], direction);
        const frames = select("frame", Object.entries(words.frames), frame);
        const name = () => {
            const chosen = directions.value || direction;
            const said = texts.action.straight[frames.value];
            directions.replaceChildren(
                ...DIRECTIONS.map((key) =>
                    el("option", { value: key, text: said[key], selected: key === chosen }),
                ),
            );
        };
        name();
        frames.addEventListener("change", name);
        return [
            field(words.direction, directions),
            field(words.speed, numberInput("speed", speed * 100, 0.1, 100)),
            field(words.frame, frames),
        ];
    }

    draw_exact(action) {
        const linear = action.linear || [0.1, 0, 0];
        const angular = action.angular || [0, 0, 0];
        const frames = select("frame", Object.entries(words.frames), action.frame || "base");
        return [
            field(words.frame, frames),
            this.#axes(words.linear, "linear", linear, (value) => value * 100, 100),
            this.#axes(words.angular, "angular", angular, degrees, 180),
        ];
    }

    #joint(value) {
        const count = (this.description && this.description.joints.length) || 6;
        const joints = Array.from({ length: count }, (_, index) => [index + 1, String(index + 1)]);
        return field(words.joint, select("joint", joints, value || 1));
    }

    draw_jog_joint(action) {
        const speed = degrees(action.velocity || radians(20));
        return [
            this.#joint(action.joint),
            field(words.jointSpeed, numberInput("velocity", speed, -245, 245)),
        ];
    }

    draw_turn_joint(action) {
        const angle = degrees(action.angle || radians(30));
        return [this.#joint(action.joint), field(words.angle, numberInput("angle", angle, -360, 360))];
    }

    draw_pose(action) {
        const poses = Object.keys((this.description && this.description.poses) || {});
        const known = action.name && !poses.includes(action.name) ? [action.name, ...poses] : poses;
        const names = known.length ? known : ["ready"];
        return [field(words.pose, select("pose", names.map((name) => [name, name]), action.name))];
    }

    draw_gripper(action) {
        const { gripper_max: widest, gripper_force: strongest } = this.description || {};
        const width = action.width === undefined ? widest || 0.08 : action.width;
        const force = numberInput("force", action.force, 0.1, STRONGEST, { required: false });
        force.placeholder = strongest ? String(strongest) : "";
        return [
            field(words.width, numberInput("width", width * 1000, 0, 200)),
            field(words.force, force),
        ];
    }

    draw_move_linear(action) {
        const offset = action.offset || (action.type ? [0, 0, 0] : [0.05, 0, 0]);
        const rotation = action.rotation || [0, 0, 0];
        const speed = action.speed ? action.speed * 100 : null;
        return [
            field(words.frame, select("frame", Object.entries(words.frames), action.frame || "base")),
            this.#axes(words.offset, "offset", offset, (value) => value * 100, 100),
            this.#axes(words.rotation, "rotation", rotation, degrees, 177),
            field(words.ownSpeed, numberInput("speed", speed, 0.1, 100, { required: false })),
        ];
    }

    draw_wait(action) {
        return [field(words.wait, numberInput("duration", action.duration || 1, 0.1, 60))];
    }

    draw_repeat(action) {
        const steps = this.#stepList("repeat", action.steps || [null]);
        const times = numberInput("times", action.times || 2, 1, MOST_REPEATS, { step: 1 });
        return [field(words.times, times), ...steps];
    }

    draw_sequence(action) {
        return this.#stepList("sequence", action.steps || [null, { type: "gripper", width: 0 }]);
    }

    #stepList(inside, actions) {
        const { description } = this;
        const make = (action) => new ActionForm(action, { description, inside });
        this.steps = new StepList(make, actions);
        return this.steps.elements;
    }

    #axes(label, name, values, shown, most) {
        const inputs = AXES.map((axis, index) =>
            field(label(axis), numberInput(`${name}-${axis}`, shown(values[index]), -most, most)),
        );
        return el("div", { class: "axes" }, ...inputs);
    }

    /** What stands in a field that may stay empty, as `{name: value}`; nothing when it is. */
    #optional(name, part = 1) {
        return this.#input(name).value === "" ? {} : { [name]: this.#number(name) * part };
    }

    /** The action as the server takes it. */
    value() {
        const kind = this.kind.value;
        const lasting = this.#input("duration") ? { duration: this.#number("duration") } : {};
        switch (kind) {
            case "straight": {
                const [axis, sign] = this.#input("direction").value;
                const speed = (this.#number("speed") / 100) * (sign === "+" ? 1 : -1);
                const linear = AXES.map((name) => (name === axis ? speed : 0));
                const frame = this.#input("frame").value;
                return { type: "jog_cartesian", frame, linear, angular: [0, 0, 0], ...lasting };
            }
            case "exact":
                return {
                    type: "jog_cartesian",
                    frame: this.#input("frame").value,
                    linear: AXES.map((axis) => this.#number(`linear-${axis}`) / 100),
                    angular: AXES.map((axis) => radians(this.#number(`angular-${axis}`))),
                    ...lasting,
                };
            case "jog_joint":
                return {
                    type: kind,
                    joint: this.#number("joint"),
                    velocity: radians(this.#number("velocity")),
                    ...lasting,
                };
            case "turn_joint":
                return {
                    type: kind,
                    joint: this.#number("joint"),
                    angle: radians(this.#number("angle")),
                };
            case "pose":
                return { type: kind, name: this.#input("pose").value };
            case "gripper":
                return {
                    type: kind,
                    width: this.#number("width") / 1000,
                    ...this.#optional("force"),
                };
            case "move_linear":
                return {
                    type: kind,
                    frame: this.#input("frame").value,
                    offset: AXES.map((axis) => this.#number(`offset-${axis}`) / 100),
                    rotation: AXES.map((axis) => radians(this.#number(`rotation-${axis}`))),
                    ...this.#optional("speed", 0.01),
                };
            case "wait":
                return { type: kind, ...lasting };
            case "repeat":
                return { type: kind, times: this.#number("times"), steps: this.steps.value() };
            case "sequence":
                return { type: kind, steps: this.steps.value() };
            default:
                return { type: kind };
        }
    }
}
