// The page's words, in the language that was chosen here, or that the browser asks for. Only that
// language is loaded.

import { memory } from "../core/memory.js";
import { translator } from "./phrases.js";

/** What there is, each by its own name, and with its own word for "language". */
export const LANGUAGES = Object.freeze({
    en: { name: "English", word: "Language" },
    de: { name: "Deutsch", word: "Sprache" },
});

const known = (language) => Object.hasOwn(LANGUAGES, language || "");

/** The first of `wanted` (tags such as "de-AT") that there is; English otherwise. */
export function pickLanguage(chosen, wanted) {
    const tongues = [...wanted].map((tag) => tag.toLowerCase().split("-")[0]);
    return [chosen, ...tongues].find(known) || "en";
}

export const language = pickLanguage(memory.get("language"), navigator.languages || []);
export const { texts, phrases } = await import(`./${language}.js`);

const translate = translator(phrases, texts.numbers.decimal, texts.numbers.quote);

/** The server's plain words in the language of the page; as they are where it has no others. */
export function told(text) {
    const plain = String(text || "");
    return translate(plain) ?? plain;
}

/** The same of an error's message, or what is known of its code: {code, message}. "" for neither. */
export function toldError({ code, message }) {
    const plain = message ? translate(message) : null;
    return plain ?? texts.errors.codes[code] ?? message ?? "";
}
