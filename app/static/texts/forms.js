// How words are put together, in any language.

/** What the server says plainly as a whole sentence; "" stays "". */
export function asSentence(text) {
    const clean = bare(text);
    return clean ? `${clean[0].toUpperCase()}${clean.slice(1)}.` : "";
}

/** Without the full stop at its end. */
export const bare = (text) => String(text || "").trim().replace(/[.\s]+$/, "");

export const plural = (count, one, many) => `${count} ${count === 1 ? one : many}`;
