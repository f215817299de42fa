// The way of a dry run in the 3D view, for as long as what was checked stands in the form.

import { texts } from "../texts/texts.js";
import { button, el } from "./dom.js";

const words = texts.check;

/** Whether nothing should move by itself. */
const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/**
 * What is said of the way below a dry run's result. `view` is the 3D view to borrow (see stage.js),
 * `forget(id)` tells the server that nothing is to be shown there any more. Give `wanted()` with
 * the question, call `told()` with its answer, and `close()` when that holds no more.
 */
export class PathView {
    #view;
    #forget;
    #asked = false;

    constructor(view, forget) {
        this.#view = view;
        this.#forget = forget;
    }

    /** What the server has to know to show the way; null where nothing can be drawn. */
    wanted() {
        if (!this.#view.canDraw) return null;
        this.#asked = true;
        return { view: this.#view.id, still: still() };
    }

    /** Elements for below the result; shows the way at once where the 3D view is open. */
    told(report, drives) {
        if (!this.#asked || report.path.times.length === 0) return [];
        const note = el("p", { class: "quiet", text: drives ? words.wayOnFloor : words.way });
        if (!this.#view.isHidden) {
            this.#view.borrow();
            return [note];
        }
        const show = button(words.showWay, {
            id: "check-3d",
            iconName: "enlarge",
            onclick: () => {
                this.#view.borrow();
                show.replaceWith(note);
            },
        });
        return [show];
    }

    close() {
        this.#view.giveBack();
        if (this.#asked) this.#forget(this.#view.id);
        this.#asked = false;
    }
}
