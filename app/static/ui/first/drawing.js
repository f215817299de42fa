// How a gesture is held: the drawing of a starter gesture, else the gesture's own template.

import { texts } from "../../texts/texts.js";
import { el } from "../dom.js";

const { signs } = texts.first;

/** How to hold the hand, in words; "" for a gesture that somebody made up. */
export const signOf = (gesture) => signs[gesture.name] || "";

/** Name of the starter sign that a gesture of this name is shown by; null where it is somebody's own. */
export const knownSign = (name) => (Object.hasOwn(signs, name) ? name : null);

/** A picture to imitate, mirrored as the webcam's is. */
export function drawing(gesture, templateUrl) {
    const known = knownSign(gesture.name) !== null;
    return el("img", {
        class: known ? "first-drawing" : "first-drawing is-template",
        src: known
            ? `static/media/hands/${gesture.name}.webp`
            : templateUrl(gesture.id, String(gesture.updated)),
        alt: texts.first.drawingOf(gesture.name),
        width: 168,
        height: 196,
        draggable: "false",
    });
}
