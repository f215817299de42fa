// What the server saw in a picture that teaches: drawn over it, and in words.

import { BONES, fitted, fingersOf, pointsIn } from "./landmarks.js";
import { texts, told } from "../texts/texts.js";
import { colour } from "./dom.js";

const words = texts.seen;

const named = (fingers) => fingers.map((finger) => words.fingers[finger] || finger).join(", ");

/** How a hand differs from the sign asked for, `sign` of a checked image, in words. */
export function signWords({ code, seen, asked, stretch, bend }) {
    switch (code) {
        case "palm_only":
            return words.palmOnly(asked);
        case "count":
            return words.count(seen, asked);
        default:
            return words.others(named(stretch), named(bend));
    }
}

/** A picture's landmarks in words, for who does not see the drawing. */
export function seenWords(seen) {
    if (!seen || !seen.landmarks) return words.nothing;
    const { hand } = seen.handedness || {};
    const side = hand ? words.sides[hand] : words.sides.unsure;
    const mended = seen.mask_agrees === false ? words.mended : "";
    return words.hand(side, named(fingersOf(seen, true)) || words.noFinger, mended).trim();
}

/**
 * What a checked picture came to: {state, text}. `state` is "good", "unlike" (a good picture of another
 * sign than the one asked for) or "bad" (the server refuses it).
 */
export function takeVerdict(image, resembles = null) {
    if (image.sign) return { state: "unlike", text: signWords(image.sign) };
    if (!image.accepted) return { state: "bad", text: told(image.reason) };
    const [advice] = image.advice || [];
    const text =
        resembles ? texts.teach.stillResembles(resembles)
        : advice ? words.advised(told(advice.message))
        : texts.teach.stillGood;
    return { state: "good", text };
}

/** Draw a picture and, once it is known, the hand seen in it. */
export function drawTake(canvas, bitmap, seen = null) {
    const { width, height } = canvas;
    const context = canvas.getContext("2d");
    const { scale, x, y } = fitted([bitmap.width, bitmap.height], width, height);
    context.clearRect(0, 0, width, height);
    context.drawImage(bitmap, x, y, bitmap.width * scale, bitmap.height * scale);
    const points = pointsIn(seen, width, height);
    if (!points) return;
    const bones = new Path2D();
    for (const [from, to] of BONES) {
        bones.moveTo(...points[from]);
        bones.lineTo(...points[to]);
    }
    context.lineCap = "round";
    // A dark rim, so that they are seen before light walls, too.
    for (const [style, thick, dot] of [["rgba(5, 8, 10, 0.6)", 4, 3], [colour("--overlay-found"), 2, 2]]) {
        context.strokeStyle = style;
        context.fillStyle = style;
        context.lineWidth = thick;
        context.stroke(bones);
        for (const [across, down] of points) {
            context.beginPath();
            context.arc(across, down, dot, 0, 2 * Math.PI);
            context.fill();
        }
    }
}
