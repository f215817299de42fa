// What the server says in plain English, in another language: sentences by a table of phrases.

const NUMBER = /^\d+\.\d+%?$/;
const QUOTED = /^(['"])(.*)\1$/;

const pattern = (english) =>
    new RegExp(`^${english.split("{}").map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.+?)")}$`);

/**
 * A function that puts a sentence of the server into the language of `phrases`, a list of
 * [English, translated]: "{}" stands for what varies, and "{1}" in the translation for the first of
 * that. What varies is translated too where it can be. The function answers null for what it does not
 * know. Without phrases everything stays as it is.
 */
export function translator(phrases, decimal = ".", quote = (text) => `“${text}”`) {
    if (!phrases) return (text) => text;
    const table = phrases.map(([english, translated]) => [pattern(english), translated]);

    const inner = (text) => {
        const known = told(text);
        if (known !== null) return known;
        if (NUMBER.test(text)) return text.replace(".", decimal);
        const quoted = QUOTED.exec(text);
        return quoted ? quote(quoted[2]) : text;
    };

    function told(text) {
        const plain = text.replace(/\.$/, "");
        const stop = plain === text ? "" : ".";
        const lower = plain.charAt(0).toLowerCase() + plain.slice(1);
        for (const [english, translated] of table) {
            const found = english.exec(plain) || english.exec(lower);
            if (!found) continue;
            return translated.replace(/\{(\d)\}/g, (_, number) => inner(found[Number(number)])) + stop;
        }
        return null;
    }
    return told;
}
