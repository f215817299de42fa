// The choice of the page's language.

import { language, LANGUAGES, texts } from "../texts/texts.js";
import { el, want } from "./dom.js";

/** Buttons, one a language, each in its own words; their label is in all of them. */
export function languageChoice() {
    const tongues = Object.entries(LANGUAGES);
    const label = tongues.flatMap(([lang, { word }], index) => [
        ...(index ? [" · "] : []),
        el("span", { lang, text: word }),
    ]);
    const buttons = tongues.map(([lang, { name }]) =>
        el("button", {
            type: "button",
            lang,
            text: name,
            "aria-pressed": String(lang === language),
            data: { language: lang },
            onclick: ({ currentTarget }) => {
                if (lang !== language) want(currentTarget, "language", { language: lang });
            },
        }),
    );
    return el(
        "div",
        { class: "language", role: "group", "aria-labelledby": "language-label" },
        el("p", { id: "language-label" }, ...label),
        el("div", { class: "row" }, ...buttons),
        el("p", { class: "quiet", text: texts.language.note }),
    );
}
