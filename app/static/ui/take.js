// One picture that was taken to teach: small, with the hand that was seen in it, and its verdict.

import { texts } from "../texts/texts.js";
import { button, el, icon, setIcon, setText } from "./dom.js";
import { drawTake, seenWords, takeVerdict } from "./seen.js";

const WIDTH = 144;
const HEIGHT = 108;
const MARKS = { good: "check", unlike: "swap", bad: "close" };

/** `element` is an item of a list. `onRemove` may be null. */
export class Take {
    #canvas = el("canvas", { width: WIDTH, height: HEIGHT, role: "img", "aria-label": texts.teach.checking });
    #mark = icon("clock");
    #text = el("span", { text: texts.teach.checking });
    #image = null;
    #bitmap = null;
    #closed = false;

    constructor(blob, onRemove = null) {
        this.blob = blob;
        this.state = "checking";
        this.remove = onRemove && button("", { class: "round small", iconName: "close", onclick: () => onRemove(this) });
        this.element = el(
            "li",
            { data: { state: this.state } },
            this.#canvas,
            el("p", { class: "still-verdict" }, this.#mark, this.#text),
            this.remove,
        );
        this.#load(blob);
    }

    /** Say what the server makes of it. `image` as in docs/protocol.md; `resembles` names another gesture. */
    judged(image, resembles = null) {
        this.#image = image;
        const { state, text } = takeVerdict(image, resembles);
        this.#say(state, text);
        this.#canvas.setAttribute("aria-label", seenWords(image.seen));
        this.#draw();
    }

    /** The server could not be asked. */
    failed(text) {
        this.#say("unknown", text);
        this.#canvas.setAttribute("aria-label", text);
    }

    close() {
        this.#closed = true;
        if (this.#bitmap) this.#bitmap.close();
        this.#bitmap = null;
    }

    #say(state, text) {
        this.state = state;
        this.element.dataset.state = state;
        setIcon(this.#mark, MARKS[state] || "clock");
        setText(this.#text, text);
    }

    async #load(blob) {
        const bitmap = await createImageBitmap(blob).catch(() => null);
        if (this.#closed) {
            if (bitmap) bitmap.close();
            return;
        }
        this.#bitmap = bitmap;
        this.#draw();
    }

    #draw() {
        if (this.#bitmap) drawTake(this.#canvas, this.#bitmap, this.#image && this.#image.seen);
    }
}
