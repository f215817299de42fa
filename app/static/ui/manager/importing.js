// A file of gestures into the gallery: what would happen is shown before it does.

import { texts } from "../../texts/texts.js";
import { button, el } from "../dom.js";
import { withProgress } from "./progress.js";

const words = texts.manager.import;
const FATES = ["new", "replaced", "skipped", "same"];

/** A plan in one line: "2 new, 1 replaced". */
export function summary({ gestures }) {
    const counts = FATES.map((fate) => [fate, gestures.filter((one) => one.fate === fate).length]);
    const said = counts.filter(([, count]) => count).map(([fate, count]) => words.counts[fate](count));
    return said.length ? said.join(", ") : words.empty;
}

/** Whether importing would change anything. */
export const changesSomething = ({ gestures }) =>
    gestures.some(({ fate }) => fate === "new" || fate === "replaced");

/** Ask for a file, show what it would do, and do it when it is wanted. */
export function importing(panel, signal, { act, told }) {
    let existing = "replace";
    let file = null;
    const input = el("input", {
        type: "file",
        accept: ".zip,application/zip",
        id: "import-file",
        onchange: () => {
            [file] = input.files;
            if (file) check();
        },
    });
    const place = el("div", { class: "manager-panel" });
    panel.replaceChildren(
        el("div", { class: "field" }, el("label", { for: "import-file", text: words.file }), input),
        place,
    );
    input.focus();

    const check = () =>
        withProgress(place, signal, words.reading, (ways) => act.check(file, existing, ways), planned);

    function planned(plan) {
        const choices = ["replace", "skip"].map((choice) =>
            el(
                "label",
                { class: "choice-line" },
                el("input", {
                    type: "radio",
                    name: "existing",
                    value: choice,
                    checked: choice === existing,
                    onchange: () => {
                        existing = choice;
                        check();
                    },
                }),
                el("span", { text: words.existing[choice] }),
            ),
        );
        const taken = plan.gestures.some(({ fate }) => fate === "replaced" || fate === "skipped");
        const go = button(words.go, { id: "import-go", class: "primary", onclick: () => run(plan) });
        go.disabled = !changesSomething(plan);
        return [
            el("p", { class: "matrix-verdict", role: "status", text: summary(plan) }),
            ...(taken ? [el("fieldset", {}, el("legend", { text: words.taken }), ...choices)] : []),
            el("ul", { class: "plan" }, ...plan.gestures.map(line)),
            el("div", { class: "row end" }, button(texts.actions.cancel, { onclick: () => panel.replaceChildren() }), go),
        ];
    }

    const run = (plan) =>
        withProgress(
            place,
            signal,
            words.running,
            (ways) => act.import(file, existing, plan.plan, ways),
            (done) => {
                told(words.done(summary(done)), [done.change]);
                return [el("p", { class: "quiet", text: words.done(summary(done)) })];
            },
        );
}

function line({ name, fate, samples, samples_now: now }) {
    return el(
        "li",
        { data: { fate } },
        el("span", { class: "managed-name", text: name }),
        el("span", { class: "quiet", text: words.fates[fate](samples, now) }),
    );
}
