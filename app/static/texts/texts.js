// The page's words, in the language that was chosen here, or that the browser asks for. Only that
// language is loaded.

import { memory } from "../core/memory.js";

/** What there is, each by its own name. */
export const LANGUAGES = Object.freeze({ en: "English" });

const KEPT_AS = "language";
const known = (language) => Object.hasOwn(LANGUAGES, language || "");

/** The first of `wanted` (tags such as "de-AT") that there is; English otherwise. */
export function pickLanguage(chosen, wanted) {
    const tongues = [...wanted].map((tag) => tag.toLowerCase().split("-")[0]);
    return [chosen, ...tongues].find(known) || "en";
}

export const language = pickLanguage(memory.get(KEPT_AS), navigator.languages || []);
export const { texts } = await import(`./${language}.js`);

/** Remember a language; the page speaks it once it is loaded again. */
export function keepLanguage(wanted) {
    if (!known(wanted)) throw new Error(`no language "${wanted}"; there are: ${Object.keys(LANGUAGES)}`);
    memory.set(KEPT_AS, wanted);
}
