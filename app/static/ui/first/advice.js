// Is the hand seen well? From the picture and the server's `frame` messages. No page here.

// Levels of 0 to 255, and shares of the picture or of its shorter side.
const DARK = 55;
const BURNT = 250;
const MOST_BURNT = 0.35;
const HAND_DARK = 60;
const BEHIND = 80; // so much darker than its surroundings is a hand with the light behind it
const FAINT = 14; // colours that near cannot be told apart by a camera
const SMALLEST = 0.27;
const LARGEST = 0.92;
const RIM = 0.012;
const MIDDLE = 0.2; // the hand's middle keeps this share of the width from either side
const QUIET = 0.02; // part of the pixels that changes while a hand trembles

/**
 * Light and colours of a picture.
 * @param {Uint8ClampedArray} pixels RGBA, row after row
 * @param {?number[]} box of the hand, [x, y, width, height] as shares of the picture
 * @returns {{mean, burnt, hand: ?number, around: ?number, contrast: ?number}} mean levels of the
 *   picture, the hand and what is round it; `burnt` is the share of white pixels, `contrast` the
 *   distance between the mean colours of the hand and of what is round it
 */
export function measure(pixels, width, height, box = null) {
    let sum = 0;
    let burnt = 0;
    const hand = [0, 0, 0, 0];
    const around = [0, 0, 0, 0];
    for (let row = 0; row < height; row += 1) {
        for (let column = 0; column < width; column += 1) {
            const at = 4 * (row * width + column);
            const [red, green, blue] = [pixels[at], pixels[at + 1], pixels[at + 2]];
            const level = 0.299 * red + 0.587 * green + 0.114 * blue;
            sum += level;
            if (level >= BURNT) burnt += 1;
            const where = box && place((column + 0.5) / width, (row + 0.5) / height, box);
            if (!where) continue;
            const into = where === "hand" ? hand : around;
            into[0] += red;
            into[1] += green;
            into[2] += blue;
            into[3] += 1;
        }
    }
    const count = width * height;
    const found = { mean: sum / count, burnt: burnt / count, hand: null, around: null, contrast: null };
    if (!hand[3] || !around[3]) return found;
    const colours = [hand, around].map((all) => all.slice(0, 3).map((one) => one / all[3]));
    const level = ([red, green, blue]) => 0.299 * red + 0.587 * green + 0.114 * blue;
    return {
        ...found,
        hand: level(colours[0]),
        around: level(colours[1]),
        contrast: Math.hypot(...colours[0].map((one, index) => one - colours[1][index])),
    };
}

/** The palm fills the lower middle of the box; above and beside the box is the room. */
function place(x, y, [left, top, width, height]) {
    const across = (x - left) / width;
    const down = (y - top) / height;
    if (across > 0.3 && across < 0.7 && down > 0.5 && down < 0.95) return "hand";
    const near = across > -0.3 && across < 1.3 && down > -0.3 && down < 1;
    const inside = across > 0 && across < 1 && down > 0;
    return near && !inside ? "around" : null;
}

/** A box in pixels of a frame as shares of it; null without either. */
export function boxOf(frame, size) {
    const roi = frame && frame.roi;
    if (!Array.isArray(roi) || roi.length !== 4 || !size.width || !size.height) return null;
    const [x, y, width, height] = roi;
    return [x / size.width, y / size.height, width / size.width, height / size.height];
}

function light({ mean, burnt, hand, around }) {
    if (mean < DARK) return "dark";
    if (burnt > MOST_BURNT) return "glare";
    if (hand !== null && hand < HAND_DARK && around - hand > BEHIND) return "behind";
    return "good";
}

function distance([x, y, width, height], size) {
    if (x < RIM || y < RIM || x + width > 1 - RIM) return "cut";
    const shorter = Math.min(size.width, size.height);
    const length = Math.max(width * size.width, height * size.height) / shorter;
    if (length < SMALLEST) return "far";
    if (length > LARGEST) return "near";
    const middle = x + width / 2;
    if (middle < MIDDLE || middle > 1 - MIDDLE) return "aside";
    return "good";
}

function background(frame, { contrast }) {
    if (frame.doubt === "two_hands" || /^two hands/.test(frame.reason || "")) return "two";
    if (contrast !== null && contrast < FAINT) return "faint";
    return frame.mask && frame.mask.mode === "learned" ? "busy" : "good";
}

/** Whether the hand in a `frame` message rests: one that trembles, as all do, does. */
export function isStill(frame) {
    if (!frame || !frame.roi) return false;
    return Boolean(frame.still) || (Number.isFinite(frame.motion) && frame.motion <= QUIET);
}

export const LINES = Object.freeze(["light", "distance", "background", "still"]);
const FINE = new Set(["good", "busy"]);
const WAITING = new Set(["wait", "none"]);

/**
 * What is well and what is not, a line for each of LINES, as {what, code, sign}: `sign` is "good",
 * "fix" or "wait". The codes are keys of the texts' `first.check.advice`.
 * @param {?object} measured from measure(); null before the first picture
 * @param {?object} frame newest `frame` message; null when there is none or it is old
 * @param {{width, height}} size of the frames sent, in pixels
 */
export function judge(measured, frame, size) {
    const box = boxOf(frame, size);
    const two = frame && background(frame, { contrast: null }) === "two";
    const codes = {
        light: measured ? light(measured) : "wait",
        distance: !frame ? "wait" : box ? distance(box, size) : "none",
        background: !frame || !measured || !(box || two) ? "wait" : background(frame, measured),
        still: !box ? "wait" : isStill(frame) ? "good" : "moving",
    };
    return LINES.map((what) => {
        const code = codes[what];
        const sign = FINE.has(code) ? "good" : WAITING.has(code) ? "wait" : "fix";
        return { what, code, sign };
    });
}

export const allGood = (lines) => lines.every(({ sign }) => sign === "good");
