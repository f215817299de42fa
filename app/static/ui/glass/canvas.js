// A canvas that is as sharp as the screen, and drawn in the pixels of the page.

import { colour } from "../dom.js";

/**
 * Make a canvas as fine as the screen and clear it. Returns {context, width, height}, the size in
 * CSS pixels; null while it is not shown.
 */
export function prepare(canvas) {
    const width = canvas.clientWidth;
    const height = canvas.clientHeight;
    if (!width || !height) return null;
    const ratio = window.devicePixelRatio || 1;
    const across = Math.round(width * ratio);
    const down = Math.round(height * ratio);
    if (canvas.width !== across || canvas.height !== down) {
        canvas.width = across;
        canvas.height = down;
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    return { context, width, height };
}

/** The colours of drawings, from the constants: {ground, curve, cut, line, text, match}. */
export function colours() {
    return {
        ground: colour("--plot-ground"),
        curve: colour("--plot-curve"),
        cut: colour("--plot-cut"),
        line: colour("--plot-line"),
        text: colour("--plot-text"),
        match: colour("--overlay-match"),
    };
}
