// The arm in figures: joints with their limits, gripper, tool, what is being done.

import { texts } from "../texts/en.js";
import { button, el, part, setText, want } from "./dom.js";
import { angle, degrees, describeAction, number, short } from "./words.js";

const words = texts.readout;
const NEAR_LIMIT = 0.04; // of the joint's range

function jointRow(index) {
    const value = el("span", { class: "joint-value", text: "–" });
    const needle = el("span", { class: "joint-needle" });
    const bar = el("span", { class: "joint-bar" }, needle);
    const low = el("span", { class: "joint-end" });
    const high = el("span", { class: "joint-end" });
    const item = el(
        "li",
        { data: { joint: String(index + 1) } },
        el("span", { class: "joint-name", text: words.joint(index + 1) }),
        low,
        bar,
        high,
        value,
    );
    return { item, value, needle, low, high };
}

export function readout(element, store) {
    const joints = part(element, "joints");
    const facts = part(element, "facts");
    const fact = (name, label) => {
        const value = el("dd", { id: `arm-${name}`, text: "–" });
        facts.append(el("div", {}, el("dt", { text: label }), value));
        return value;
    };
    const doing = part(element, "doing");
    const gripper = fact("gripper", words.gripper);
    const tool = fact("tool", words.tool);
    const nearest = fact("nearest", words.nearest);
    const active = fact("limits", words.limits);
    const putBack = button(texts.resetScene.button, {
        id: "btn-reset-scene",
        title: texts.resetScene.when,
        onclick: () => want(element, "reset-scene"),
    });
    part(element, "tools").append(putBack);
    let rows = [];
    let drawnAt = 0;
    let timer = 0;

    function draw() {
        drawnAt = performance.now();
        const { robot, description } = store.state;
        const values = (robot && robot.joints) || [];
        if (rows.length !== values.length) {
            rows = values.map((_, index) => jointRow(index));
            joints.replaceChildren(...rows.map(({ item }) => item));
        }
        const limits = (description && description.joints) || [];
        rows.forEach(({ item, value, needle, low, high }, index) => {
            const limit = limits[index];
            const lower = limit ? limit.lower : -Math.PI;
            const upper = limit ? limit.upper : Math.PI;
            const share = (values[index] - lower) / (upper - lower);
            needle.style.left = `${(Math.min(1, Math.max(0, share)) * 100).toFixed(1)}%`;
            setText(value, angle(values[index]));
            setText(low, limit ? number(degrees(lower), 0) : "");
            setText(high, limit ? number(degrees(upper), 0) : "");
            const near = Boolean(limit) && (share < NEAR_LIMIT || share > 1 - NEAR_LIMIT);
            item.classList.toggle("is-near-limit", near);
        });
        setText(doing, robot && robot.action ? describeAction(robot.action, description) : words.nothing);
        const width = robot && robot.gripper;
        setText(gripper, Number.isFinite(width) ? words.gripperOpen(number(width * 1000, 0)) : "–");
        const position = robot && robot.tool && robot.tool.position;
        tool.parentElement.hidden = !Array.isArray(position);
        if (Array.isArray(position)) {
            setText(tool, words.toolValue(...position.map((metres) => short(metres * 100, 0))));
        }
        const near = robot && robot.clearance;
        nearest.parentElement.hidden = !near;
        if (near) {
            const thing = near.itself ? words.itself(near.thing) : near.thing;
            setText(nearest, words.nearestValue(number(near.distance * 1000, 0), thing, near.link));
        }
        const limited = (robot && robot.limits) || [];
        active.parentElement.hidden = !limited.length;
        setText(active, limited.join(", "));
        putBack.disabled = !robot || !robot.online || robot.armed || robot.mode === "faulted";
    }

    store.watch(["robot", "description"], () => {
        if (timer) return;
        timer = setTimeout(() => {
            timer = 0;
            draw();
        }, Math.max(0, 100 - (performance.now() - drawnAt)));
    });
}
