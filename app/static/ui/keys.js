// Keys that work from anywhere on the page, and from inside the 3D view's frame.

import { isField, isTyped, want } from "./dom.js";

const LETTERS = { a: "toggle-arm", c: "toggle-control", f: "toggle-fine", w: "swap", "?": "help" };

/** A slider goes on meaning its own by the arrow keys. */
const takesArrows = (element) => Boolean(element && element.closest && element.closest("input"));

/**
 * Space and Escape stop, whatever has the focus, unless somebody types in a field (Escape then
 * leaves the field). A list to choose from has them for itself only while nothing can move. `jog` is
 * asked about every other key. `closeSheet` closes what lies over the page and says whether there was
 * something; where nothing can move, Escape does only that.
 */
export function keys(root, { closeSheet, canMove, jog }) {
    let swallowed = false;

    function down(event, stopOnly = false) {
        if (event.ctrlKey || event.metaKey || event.altKey || event.isComposing) return;
        const typing = isField(event.target);
        const theirs = isTyped(event.target) || (typing && !canMove());
        if (event.key === "Escape") {
            if (theirs) {
                event.target.blur();
            } else if (!event.repeat) {
                const closed = closeSheet();
                if (!closed || canMove()) want(root, "stop");
            }
            event.preventDefault();
        } else if (event.key === " " && !theirs) {
            event.preventDefault(); // neither scrolls nor presses what has the focus
            swallowed = true;
            if (!event.repeat) want(root, "stop");
        } else if (!stopOnly && !typing && !takesArrows(event.target) && jog.down(event)) {
            event.preventDefault();
        } else if (!stopOnly && !typing && !event.repeat && LETTERS[event.key.toLowerCase()]) {
            want(root, LETTERS[event.key.toLowerCase()]);
        }
    }

    function up(event) {
        jog.up(event);
        if (event.key === " " && swallowed) event.preventDefault();
        if (event.key === " ") swallowed = false;
    }

    window.addEventListener("keydown", down, true);
    window.addEventListener("keyup", up, true);

    return {
        /** Let the stop keys work in a frame too; its letters move the camera there. */
        listen(frame) {
            frame.addEventListener("keydown", (event) => down(event, true), true);
            frame.addEventListener("keyup", up, true);
        },
    };
}
