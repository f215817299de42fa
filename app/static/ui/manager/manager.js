// The sheet that holds all gestures of a gallery: their pictures, names and states, how well they
// are told apart, and the whole gallery as a file.

import { texts } from "../../texts/texts.js";
import { button, el, setText } from "../dom.js";
import { describeError } from "../words.js";
import { exporting } from "./exporting.js";
import { importing } from "./importing.js";
import { matrixView } from "./matrix.js";
import { ManagedRow } from "./row.js";

const words = texts.manager;

/**
 * Contents for the sheet.
 * @param act does the work and throws ApiError: {rename, retire, deleteSample, moveSample, matrix,
 *     check, import, export}; the first four give what holds `change`, the others take
 *     {onProgress, signal}
 * @param told (text, changes) says what was changed
 * @param edit (id) opens the sheet that teaches one gesture
 */
export function managerContent({ store, templateUrl, act, told, edit }) {
    const list = el("ul", { class: "managed", id: "managed" });
    const note = el("p", { class: "quiet" });
    const problem = el("p", { class: "problem-line", role: "alert", id: "manager-problem" });
    const panel = el("div", { class: "manager-panel", id: "manager-panel" });
    const rows = new Map(); // by id
    let running = null; // AbortController of what the panel does

    /** Do one thing with a gesture; what went wrong is said, and nothing else happens then. */
    async function change(work, text) {
        setText(problem, "");
        try {
            const { change: made } = await work();
            told(text, [made]);
            return true;
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            setText(problem, describeError(error));
            return false;
        }
    }

    /** Use the panel for something else; what it did before is cancelled. */
    function usePanel(show) {
        if (running) running.abort();
        running = new AbortController();
        setText(problem, "");
        show(panel, running.signal, { act, told, edit, store });
    }

    function draw({ gestures, gesturesState }) {
        setText(
            note,
            gesturesState === "failed" ? texts.gestures.failed
            : gestures.length ? words.note(gestures.filter(({ active }) => active !== false).length, gestures.length)
            : texts.gestures.empty,
        );
        const inside = () => (list.contains(document.activeElement) ? document.activeElement : null);
        const focused = inside();
        const mine = [...rows.values()].find(({ element }) => element.contains(focused));
        for (const id of [...rows.keys()]) {
            if (!gestures.some((gesture) => gesture.id === id)) rows.delete(id);
        }
        for (const gesture of gestures) {
            if (!rows.has(gesture.id)) rows.set(gesture.id, new ManagedRow({ templateUrl, act, change, edit }));
            rows.get(gesture.id).update(gesture, gestures, store.state.description);
        }
        const kept = inside(); // what a row has put in the place of what had the focus
        const elements = gestures.map(({ id }) => rows.get(id).element);
        // To put something in its place again would take the focus from it.
        if (elements.length !== list.childElementCount || elements.some((one, index) => one !== list.children[index])) {
            list.replaceChildren(...elements);
        }
        if (kept && kept.isConnected) kept.focus();
        else if (focused && mine && mine.element.isConnected) mine.focus();
    }
    const deaf = store.watch(["gestures", "gesturesState", "description"], draw);

    const tools = [
        ["matrix", words.matrix.start, matrixView],
        ["import", words.import.start, importing],
        ["export", words.export.start, exporting],
    ].map(([name, label, show]) =>
        button(label, { id: `manager-${name}`, onclick: () => usePanel(show) }),
    );
    return {
        content: [el("div", { class: "row" }, ...tools), panel, note, problem, list],
        close() {
            deaf();
            if (running) running.abort();
        },
    };
}
