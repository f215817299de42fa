// Below an action's form: would it break a limit? And the actions that the gesture had before.

import { language, texts } from "../texts/texts.js";
import { field, select } from "./action-inputs.js";
import { button, el, setText } from "./dom.js";
import { describeAction, describeError, short, toldOf } from "./words.js";

const words = texts.check;

/** What a dry run found, in plain words: {good, title, lines}. */
export function describeReport(report, description = null) {
    const serious = report.problems.filter(({ kind }) => kind !== "slowed");
    const lines = report.problems.map(({ step, time_s: time, message, kind }) => {
        const plain = toldOf(message, description);
        const said = plain.charAt(0).toUpperCase() + plain.slice(1);
        const where = step === null ? words.anywhere(said) : words.inStep(step, said);
        return { text: words.after(where, short(time)), serious: kind !== "slowed" };
    });
    const lasts = short(report.duration_s);
    const good = lines.length ? words.goodSlowed(lasts) : words.good(lasts);
    const title = report.ok ? good : words.bad(serious.length);
    return { good: report.ok, title, lines };
}

/** Where a dry run can begin: a robot that drives, only where it is. */
function startsOf(description) {
    const here = ["current", words.current];
    if (description && description.drives) return [here];
    const poses = Object.keys((description && description.poses) || {}).filter((name) => name !== "home");
    return [here, ["home", words.home], ...poses.map((name) => [name, name])];
}

/**
 * A button that tries the form's action and says what came of it. `check(action, from, path)` asks;
 * `path` is a PathView, to be closed by whoever made it.
 */
export function programCheck({ form, description, check, path }) {
    const starts = startsOf(description);
    const from = select("from", starts, "current");
    const result = el("div", { class: "check-result", role: "status", id: "check-result" });
    const start = button(words.check, { id: "action-check", iconName: "check", onclick: run });

    async function run() {
        if (!form.check()) return;
        start.disabled = true;
        form.mark(new Set());
        result.className = "check-result";
        result.replaceChildren(el("p", { class: "quiet", text: words.checking }));
        try {
            path.close();
            show(await check(form.value(), from.value, path.wanted()));
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            result.className = "check-result is-bad";
            result.replaceChildren(el("p", { text: describeError(error) }));
        } finally {
            start.disabled = false;
        }
    }

    function show(report) {
        const { good, title, lines } = describeReport(report, description);
        result.className = `check-result ${good ? "is-good" : "is-bad"}`;
        const items = lines.map(({ text, serious }) =>
            el("li", { class: serious ? "is-serious" : null, text }),
        );
        result.replaceChildren(
            el("p", { class: "check-title", text: title }),
            ...(items.length ? [el("ul", { class: "check-list" }, ...items)] : []),
            ...path.told(report, Boolean(description && description.drives)),
        );
        form.mark(new Set(report.problems.filter(({ kind }) => kind !== "slowed").map(({ step }) => step)));
        result.scrollIntoView({ block: "nearest" });
    }

    // What was found holds for what was checked.
    form.element.addEventListener("input", () => {
        if (!result.childElementCount) return;
        path.close();
        result.className = "check-result";
        result.replaceChildren();
        form.mark(new Set());
    });
    return el("div", { class: "program-check" }, field(words.from, from), start, result);
}

/** The actions that a gesture had, each with a button that brings it back. */
export function formerVersions({ gesture, description, list, restore }) {
    const box = el("div", { class: "former" });
    const note = el("p", { class: "quiet" });
    const open = button(words.former, { id: "action-former", onclick: load });
    box.append(open, note);

    async function load() {
        open.disabled = true;
        try {
            const versions = await list();
            const rows = versions.filter(({ version }) => version !== gesture.version).reverse();
            open.remove();
            setText(note, rows.length ? words.formerNote : words.noFormer);
            box.append(el("ul", { class: "former-list" }, ...rows.map(row)));
        } catch (error) {
            if (typeof error.status !== "number") throw error;
            setText(note, describeError(error));
            open.disabled = false;
        }
    }

    function row({ version, action, created }) {
        const when = new Date(created).toLocaleString(language);
        return el(
            "li",
            {},
            el(
                "span",
                {},
                el("span", { text: describeAction(action, description) }),
                el("span", { class: "quiet", text: words.since(when) }),
            ),
            button(words.restore, {
                "aria-label": words.restoreVersion(version),
                data: { version },
                onclick: () => restore(version),
            }),
        );
    }
    return box;
}
