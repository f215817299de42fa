// Choosing what a gesture does, without writing JSON.

import { texts } from "../texts/en.js";
import { button, el } from "./dom.js";
import { degrees, radians } from "./words.js";

const words = texts.actionForm;
const AXES = ["x", "y", "z"];
const DIRECTIONS = ["x+", "x-", "y+", "y-", "z+", "z-"];
const MOST_STEPS = 32;
const SIMPLE = ["straight", "jog_joint", "turn_joint", "gripper", "pose", "home", "stop", "exact"];
let ids = 0;

function field(label, input) {
    ids += 1;
    input.id = `action-field-${ids}`;
    return el("div", { class: "field" }, el("label", { for: input.id, text: label }), input);
}

function numberInput(name, value, min, max, step = "any") {
    const shown = String(Number(value.toFixed(2)));
    return el("input", { type: "number", name, value: shown, min, max, step, required: true });
}

function select(name, options, value) {
    return el(
        "select",
        { name },
        ...options.map(([key, text]) =>
            el("option", { value: key, text, selected: String(key) === String(value) }),
        ),
    );
}

/** The straight direction and speed of a Cartesian jog; null when it is not along one axis. */
function straightOf(action) {
    const linear = action.linear || [0, 0, 0];
    if ((action.angular || []).some(Boolean)) return null;
    const moving = linear.map((speed, axis) => [speed, axis]).filter(([speed]) => speed);
    if (moving.length !== 1) return null;
    const [speed, axis] = moving[0];
    return { direction: AXES[axis] + (speed > 0 ? "+" : "-"), speed: Math.abs(speed) };
}

function kindOf(action) {
    if (action.type !== "jog_cartesian") return action.type;
    return straightOf(action) ? "straight" : "exact";
}

/**
 * A form for one action. `value()` reads it; `element` goes into the page. Inside a sequence
 * (`step` is true) jogs ask for how long, and there are no sequences. `touched` says whether
 * anything was changed: an untouched action is not read back, since degrees are shown rounded.
 */
export class ActionForm {
    constructor(action, { description = null, step = false } = {}) {
        this.description = description;
        this.step = step;
        this.action = action || { type: "jog_cartesian", frame: "base", linear: [0.1, 0, 0] };
        const kinds = step ? SIMPLE : [...SIMPLE, "sequence"];
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
        if (this.steps && !this.steps.every(({ form }) => form.check())) return false;
        const inputs = [...this.fields.querySelectorAll("input")];
        return inputs.every((input) => input.reportValidity());
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
        if (this.step && ["straight", "exact", "jog_joint"].includes(kind)) {
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
            ...AXES.map((axis, index) =>
                field(words.linear(axis), numberInput(`linear-${axis}`, linear[index] * 100, -100, 100)),
            ),
            ...AXES.map((axis, index) =>
                field(
                    words.angular(axis),
                    numberInput(`angular-${axis}`, degrees(angular[index]), -180, 180),
                ),
            ),
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
        const widest = (this.description && this.description.gripper_max) || 0.08;
        const width = action.width === undefined ? widest : action.width;
        return [field(words.width, numberInput("width", width * 1000, 0, 200))];
    }

    draw_sequence(action) {
        this.steps = [];
        const list = el("ol", { class: "step-list" });
        const add = button(words.addStep, { iconName: "plus", onclick: () => append(null) });
        const redraw = () => {
            list.replaceChildren(...this.steps.map(({ item }) => item));
            this.steps.forEach(({ title, up, remove }, index) => {
                title.textContent = words.step(index + 1);
                up.setAttribute("aria-label", words.upStep(index + 1));
                remove.setAttribute("aria-label", words.removeStep(index + 1));
                up.disabled = index === 0;
                remove.disabled = this.steps.length === 1;
            });
            add.disabled = this.steps.length >= MOST_STEPS;
        };
        const append = (value) => {
            const form = new ActionForm(value, { description: this.description, step: true });
            const title = el("span", { class: "step-title" });
            const entry = { form, title };
            entry.up = button("", {
                class: "round small",
                iconName: "up",
                onclick: () => {
                    const at = this.steps.indexOf(entry);
                    this.steps.splice(at - 1, 2, entry, this.steps[at - 1]);
                    redraw();
                },
            });
            entry.remove = button("", {
                class: "round small",
                iconName: "close",
                onclick: () => {
                    this.steps.splice(this.steps.indexOf(entry), 1);
                    redraw();
                },
            });
            const head = el("div", { class: "step-head" }, title, entry.up, entry.remove);
            entry.item = el("li", {}, head, form.element);
            this.steps.push(entry);
            redraw();
        };
        for (const value of action.steps || [null, { type: "gripper", width: 0 }]) append(value);
        return [list, add];
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
                return { type: kind, width: this.#number("width") / 1000 };
            case "sequence":
                return { type: kind, steps: this.steps.map(({ form }) => form.value()) };
            default:
                return { type: kind };
        }
    }
}
