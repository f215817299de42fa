// The arm in figures: joints with their limits, gripper, tool, what is being done.

import { texts, told } from "../texts/texts.js";
import { button, el, part, setHidden, setText, want } from "./dom.js";
import { angle, degrees, describeAction, jointName, number, short, toldOf } from "./words.js";

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
        el("span", { class: "joint-name", text: jointName(index + 1) }),
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
    const place = fact("place", words.place);
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
        const drives = Boolean(description && description.drives);
        rows.forEach(({ item, value, needle, low, high }, index) => {
            const limit = drives ? null : limits[index]; // a base goes as far as its room
            const slides = Boolean(limits[index]) && limits[index].unit === "m";
            const end = (bound) => number(slides ? bound * 100 : degrees(bound), 0);
            const lower = limit ? limit.lower : -Math.PI;
            const upper = limit ? limit.upper : Math.PI;
            const share = (values[index] - lower) / (upper - lower);
            needle.style.insetInlineStart = `${(Math.min(1, Math.max(0, share)) * 100).toFixed(1)}%`;
            setHidden(needle.parentElement, drives);
            setText(value, slides ? words.slideValue(number(values[index] * 100)) : angle(values[index]));
            setText(low, limit ? end(lower) : "");
            setText(high, limit ? end(upper) : "");
            const near = Boolean(limit) && (share < NEAR_LIMIT || share > 1 - NEAR_LIMIT);
            item.classList.toggle("is-near-limit", near);
        });
        setText(doing, robot && robot.action ? describeAction(robot.action, description) : words.nothing);
        const width = robot && robot.gripper;
        setText(gripper, Number.isFinite(width) ? words.gripperOpen(number(width * 1000, 0)) : "–");
        setHidden(gripper.parentElement, Boolean(description) && description.gripper_max === 0);
        const base = robot && robot.base;
        setHidden(place.parentElement, !Array.isArray(base));
        if (Array.isArray(base)) {
            const [x, y, heading] = base;
            setText(place, words.placeValue(short(x * 100, 0), short(y * 100, 0), short(degrees(heading), 0)));
        }
        const position = robot && !base && robot.tool && robot.tool.position;
        setHidden(tool.parentElement, !Array.isArray(position));
        if (Array.isArray(position)) {
            setText(tool, words.toolValue(...position.map((metres) => short(metres * 100, 0))));
        }
        const near = robot && robot.clearance;
        setHidden(nearest.parentElement, !near);
        if (near) {
            const thing = near.itself ? words.itself(told(near.thing)) : told(near.thing);
            setText(nearest, words.nearestValue(number(near.distance * 1000, 0), thing, told(near.link)));
        }
        const limited = (robot && robot.limits) || [];
        setHidden(active.parentElement, !limited.length);
        setText(active, limited.map((limit) => toldOf(limit, description)).join(", "));
        putBack.disabled = !robot || !robot.online || robot.armed || robot.mode === "faulted";
    }

    // What scrolls is in reach of the keyboard, also while it has no button that can be pressed.
    const reach = new ResizeObserver(() => {
        if (element.scrollHeight > element.clientHeight + 1) element.tabIndex = 0;
        else element.removeAttribute("tabindex");
    });
    for (const each of [element, ...element.children]) reach.observe(each);

    store.watch(["robot", "description"], () => {
        if (timer) return;
        timer = setTimeout(() => {
            timer = 0;
            draw();
        }, Math.max(0, 100 - (performance.now() - drawnAt)));
    });
}
