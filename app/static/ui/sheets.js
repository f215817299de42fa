// Sheets over the page: never modal, because the stop button below must stay in reach. Tab goes round
// the sheet and what is beside it.

import { texts } from "../texts/texts.js";
import { button, el } from "./dom.js";
import { languageChoice } from "./language.js";
import { tabCircle } from "./tab-circle.js";

/** At most one sheet is open. */
export class Sheets {
    #host;
    #places;
    #open = null;

    /** `beside`: elements that stay in reach of Tab with those of `host`. */
    constructor(host, beside = []) {
        this.#host = host;
        const order = (one, other) =>
            one.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING ? -1 : 1;
        this.#places = [host, ...beside].sort(order);
    }

    get isOpen() {
        return this.#open !== null;
    }

    /** Name of the open sheet, or null. */
    get name() {
        return this.#open && this.#open.name;
    }

    /** Show `content` under a title. `onclose` is called however it is closed. */
    show(name, title, content, { onclose = null, focus = null } = {}) {
        this.close();
        const heading = el("h2", { id: `${name}-title`, text: title, tabindex: "-1" });
        const sheet = el(
            "dialog",
            { class: "sheet", id: `sheet-${name}`, "aria-labelledby": heading.id },
            el(
                "div",
                { class: "sheet-head" },
                heading,
                button("", {
                    class: "round small",
                    iconName: "close",
                    "aria-label": texts.actions.close,
                    data: { part: "close" },
                    onclick: () => this.close(),
                }),
            ),
            el("div", { class: "sheet-body" }, ...[content].flat()),
        );
        const before = document.activeElement;
        this.#host.append(sheet);
        sheet.show();
        this.#open = { name, sheet, before, onclose, freeTab: tabCircle(this.#places) };
        (focus || heading).focus();
        return sheet;
    }

    /** Close what is open; says whether there was something. */
    close() {
        if (!this.#open) return false;
        const { sheet, before, onclose, freeTab } = this.#open;
        this.#open = null;
        freeTab();
        sheet.remove();
        if (onclose) onclose();
        if (before && before.isConnected && before !== document.body) before.focus();
        return true;
    }
}

/** Contents of the help sheet; `first` and `check` are called by its buttons. */
export function helpContent(first, check) {
    const { how, keysTitle, keys, keysNote, safetyTitle, safety } = texts.help;
    return [
        languageChoice(),
        el("ol", { class: "how" }, ...how.map((text) => el("li", { text }))),
        el("h3", { text: keysTitle }),
        el(
            "dl",
            { class: "key-list" },
            ...keys.map(([key, text]) =>
                el("div", {}, el("dt", {}, el("kbd", { text: key })), el("dd", { text })),
            ),
        ),
        el("p", { class: "quiet", text: keysNote }),
        el(
            "div",
            { class: "row" },
            button(texts.first.begin, { id: "help-first", onclick: first }),
            button(texts.preflight.open, { id: "preflight-open", onclick: check }),
        ),
        el("h3", { text: safetyTitle }),
        el("p", { text: safety }),
    ];
}

/** A question with one way on and one way back. */
export function askContent(words, yesLabel, yes, no) {
    return [
        el("p", { text: words }),
        el(
            "div",
            { class: "row end" },
            button(texts.actions.cancel, { onclick: no, data: { part: "no" } }),
            button(yesLabel, { class: "primary", onclick: yes, data: { part: "yes" } }),
        ),
    ];
}

/** What covers the cockpit while the server is gone; the dock stays free. */
export function goneContent(kind, why, retry) {
    const { gone } = texts;
    const signedOut = kind === "signedOut";
    const [title, words] = {
        signedOut: [gone.signedOutTitle, gone.signedOutWords],
        away: [gone.awayTitle, gone.awayWords(why)],
        gone: [gone.title, gone.words],
    }[kind];
    return el(
        "div",
        { class: "gone-card" },
        el("p", { class: "gone-title", text: title }),
        el("p", { text: words }),
        button(signedOut ? gone.signIn : gone.retry, {
            class: "primary",
            id: "gone-retry",
            onclick: () => (signedOut ? location.assign("signin") : retry()),
        }),
    );
}
