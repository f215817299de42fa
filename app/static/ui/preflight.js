// The list of what was checked, each with what to do about it.

import { texts } from "../texts/texts.js";
import { el, setText } from "./dom.js";

const words = texts.preflight;

/** Title and advice for one finding. */
export function describeFinding({ what, code }) {
    if (code === "fine") return { title: words.fine[what], words: "" };
    if (what === "camera") return texts.sourceErrors[code] || texts.sourceErrors.failed;
    return words.problems[what];
}

/** Contents of the sheet, and `show(finding)` that fills it. */
export function preflightContent() {
    const note = el("p", { class: "quiet", text: words.checking, role: "status" });
    const list = el("ul", { class: "preflight", id: "preflight" });
    let problems = 0;
    return {
        content: [note, list],
        show(finding) {
            const fine = finding.code === "fine";
            if (!fine) problems += 1;
            const { title, words: advice } = describeFinding(finding);
            list.append(
                el(
                    "li",
                    { class: fine ? "is-fine" : "is-bad", data: { what: finding.what, code: finding.code } },
                    el("strong", { text: title }),
                    advice ? el("p", { text: advice }) : null,
                ),
            );
        },
        done() {
            setText(note, problems ? words.some : words.none);
            note.dataset.done = String(problems);
        },
    };
}
