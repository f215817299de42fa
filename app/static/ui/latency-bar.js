// The bar that shows where the time of one frame goes, and how old the robot's picture is.

import { texts } from "../texts/texts.js";
import { el, setHidden, setText } from "./dom.js";

const words = texts.latency;
const EVERY_MS = 250;
const NAMES = Object.keys(words.names);

/**
 * Appends the bar to `element`. `read()` gives what core/latency.js calls a reading. The bar is a
 * button: pointing at it, focus and a press show the list of its parts, which readers always have.
 */
export function latencyBar(element, read) {
    const segments = new Map();
    const rows = new Map();
    const track = el("span", { class: "latency-track", "aria-hidden": "true" });
    const list = el("dl", { class: "latency-list", id: "latency-list" });
    for (const name of NAMES) {
        const segment = el(
            "span",
            { class: "latency-part", data: { name } },
            el("span", { class: "latency-short", text: words.short[name] }),
        );
        const value = el("dd", { data: { name } });
        const swatch = el("span", { class: "latency-part swatch", data: { name }, "aria-hidden": "true" });
        segments.set(name, segment);
        rows.set(name, value);
        track.append(segment);
        list.append(el("div", {}, swatch, el("dt", { text: words.names[name] }), value));
    }
    const sum = el("dd");
    const age = el("dd");
    list.append(
        el("div", { class: "latency-sum" }, el("dt", { text: words.sum }), sum),
        el("div", {}, el("dt", { text: words.pictureAge }), age),
    );
    const total = el("strong", { id: "latency-total" });
    const note = el("span", { class: "latency-note" });
    const old = el("span", { id: "latency-age" });
    const toggle = el("button", {
        type: "button",
        class: "latency-bar",
        id: "latency-bar",
        "aria-label": words.title,
        "aria-expanded": "false",
        "aria-controls": "latency-list",
        onclick: () => open(box.dataset.open !== "yes"),
    });
    toggle.append(track);
    const box = el(
        "div",
        { class: "latency", id: "latency" },
        toggle,
        el("p", { class: "latency-words" }, el("span", {}, total, note), old),
        list,
    );
    element.append(box);

    function open(wanted) {
        box.dataset.open = wanted ? "yes" : "no";
        toggle.setAttribute("aria-expanded", String(wanted));
    }

    function draw() {
        const { parts, total: all, whole, pictureAge } = read();
        for (const { name, ms } of parts) {
            const segment = segments.get(name);
            setHidden(segment, ms === null);
            segment.style.flexGrow = String(ms || 0);
            segment.classList.toggle("is-short", ms === null || all === null || ms < all * 0.09);
            const text = ms === null ? words.unknown : words.ms(ms);
            segment.title = `${words.names[name]}: ${text}`;
            setText(rows.get(name), text);
        }
        setText(total, all === null ? "" : words.total(all));
        setText(note, all === null ? words.none : whole ? words.whole : words.partly);
        setText(old, pictureAge === null ? words.noPicture : words.age(pictureAge));
        setText(sum, all === null ? words.unknown : words.ms(all));
        setText(age, pictureAge === null ? words.noPicture : words.ms(pictureAge));
    }
    draw();
    setInterval(draw, EVERY_MS);
}
