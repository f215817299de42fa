// How often each gesture is taken for each other one: a table, and what to do about the worst.

import { texts } from "../../texts/texts.js";
import { button, el } from "../dom.js";
import { withProgress } from "./progress.js";

const words = texts.manager.matrix;
const LEVELS = 4;

/** The matrix in one sentence: {text, teach: id or null}. */
export function verdict({ gestures, worst }) {
    if (!gestures.some(({ asked }) => asked)) return { text: words.nothing, teach: null };
    if (!worst) return { text: words.good, teach: null };
    const name = (id) => gestures.find((gesture) => gesture.id === id).name;
    const { shown, other, level, times, asked, teach } = worst;
    return { text: words.worst[level](name(shown), name(other), times, asked, name(teach)), teach };
}

/** From 0 (never) to LEVELS (always): how dark a cell is. Anything but never can be seen. */
export function shade(count, asked) {
    return count && asked ? Math.max(1, Math.round((LEVELS * count) / asked)) : 0;
}

function cell(count, asked, kind) {
    const level = shade(count, asked);
    return el("td", { class: level ? `${kind} shade-${level}` : "is-none", text: String(count) });
}

const head = (scope, text) => el("th", { scope }, el("span", { text }));

/** The table; rows are what is shown, columns what it is taken for. */
export function matrixTable({ gestures, counts, rejected }) {
    const columns = [...gestures.map(({ name }) => name), words.rejected];
    const rows = gestures.map(({ name, asked }, row) =>
        el(
            "tr",
            {},
            head("row", words.row(name, asked)),
            ...gestures.map((_, column) => cell(counts[row][column], asked, row === column ? "is-right" : "is-wrong")),
            cell(rejected[row], asked, "is-rejected"),
        ),
    );
    return el(
        "div",
        { class: "matrix-scroll", tabindex: "0", role: "region", "aria-label": words.title },
        el(
            "table",
            { class: "matrix", "aria-label": words.title },
            el(
                "thead",
                {},
                el("tr", {}, ...[words.corner, ...columns].map((text) => head("col", text))),
            ),
            el("tbody", {}, ...rows),
        ),
    );
}

/** Work it out, and show it in `panel`. */
export function matrixView(panel, signal, { act, edit }) {
    return withProgress(panel, signal, words.running, act.matrix, (result) => {
        const { text, teach } = verdict(result);
        const { gestures, untested } = result;
        const names = untested.map((id) => gestures.find((gesture) => gesture.id === id).name);
        return [
            el("p", { class: "matrix-verdict", role: "status", text }),
            ...(teach ? [el("div", { class: "row" }, button(texts.manager.teachAgain, { id: "matrix-teach", onclick: () => edit(teach) }))] : []),
            ...(names.length ? [el("p", { class: "quiet", text: words.untested(names.join(", ")) })] : []),
            ...(gestures.length ? [el("p", { class: "quiet", text: words.legend }), matrixTable(result)] : []),
            el("p", { class: "quiet", text: words.caution }),
        ];
    });
}
