// How far long work is, and a way to end it.

import { texts } from "../../texts/texts.js";
import { button, el, setText } from "../dom.js";
import { describeError } from "../words.js";

const words = texts.manager;

/**
 * Show long work in `host`: a bar, words and a button that cancels. `work({onProgress, signal})`
 * does it; onProgress takes (done, total), or (null, null, text) when nobody knows how much there
 * is. `show(result)` gives what is there afterwards. `outer` ends it from outside.
 */
export async function withProgress(host, outer, label, work, show) {
    const cancelling = new AbortController();
    const end = () => cancelling.abort();
    outer.addEventListener("abort", end);
    const bar = el("progress", { max: "1", "aria-label": label });
    const text = el("p", { class: "quiet", text: label, role: "status" });
    const cancel = button(texts.actions.cancel, {
        data: { part: "cancel" },
        onclick: () => {
            cancel.disabled = true;
            setText(text, words.cancelling);
            end();
        },
    });
    host.replaceChildren(el("div", { class: "progress-line" }, bar, cancel), text);
    const onProgress = (done, total, said = label) => {
        if (cancelling.signal.aborted) return;
        if (total) bar.value = done / total;
        else bar.removeAttribute("value");
        setText(text, said);
    };
    let shown;
    try {
        shown = show(await work({ onProgress, signal: cancelling.signal }));
    } catch (error) {
        if (typeof error.status !== "number") throw error; // a mistake of the page
        const wasCancelled = error.code === "cancelled";
        const said = wasCancelled ? words.cancelled : describeError(error);
        shown = [el("p", { class: wasCancelled ? "quiet" : "problem-line", role: "alert", text: said })];
    } finally {
        outer.removeEventListener("abort", end);
    }
    // Somebody uses the place for something else by now.
    if (!outer.aborted) host.replaceChildren(...shown);
}
