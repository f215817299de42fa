// Taking still pictures of the hand, with a countdown, and saying at once whether one is usable.

import { texts } from "../texts/texts.js";
import { button, el, setLabel, setText } from "./dom.js";
import { Take } from "./take.js";
import { describeError } from "./words.js";

const words = texts.teach;
const COUNT_FROM = 3;
const COUNT_MS = 800;
const BETWEEN_MS = 900;
const MOST = 8;

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * `video` is the source that plays now; `grab()` gives its picture as a JPEG Blob or null;
 * `check(blob)` has the server judge it as enrolment would. `stills` holds the Blobs that it does not
 * refuse.
 */
export class Capture {
    #run = 0;
    #counting = false;

    constructor({ video, store, grab, check, onTaken }) {
        this.store = store;
        this.grab = grab;
        this.check = check;
        this.onTaken = onTaken;
        this.video = video;
        this.entries = [];
        this.preview = el("canvas", { class: "capture-preview", "aria-hidden": "true" });
        this.counter = el("p", { class: "capture-count", role: "status" });
        this.note = el("p", { class: "problem-line", role: "status" });
        this.list = el("ul", { class: "stills", "aria-live": "polite" });
        this.one = button(words.capture, {
            id: "capture-one",
            iconName: "camera",
            onclick: () => (this.#counting ? this.#cancel() : this.#take(1)),
        });
        this.three = button(words.captureThree, { id: "capture-three", onclick: () => this.#take(3) });
        this.element = el(
            "div",
            { class: "capture" },
            el("div", { class: "capture-frame" }, this.preview, this.counter),
            el("div", { class: "row" }, this.one, this.three),
            this.note,
            this.list,
        );
        this.timer = setInterval(() => this.#drawPreview(), 66);
        this.#drawPreview();
    }

    get stills() {
        return this.entries.filter(({ state }) => state !== "bad").map(({ blob }) => blob);
    }

    /** Stop the countdown and the preview. */
    close() {
        this.#run += 1;
        clearInterval(this.timer);
        for (const take of this.entries) take.close();
    }

    clear() {
        for (const take of this.entries) take.close();
        this.entries = [];
        this.#draw();
    }

    #running() {
        return this.store.state.source.state === "running" && this.video.videoWidth > 0;
    }

    #drawPreview() {
        const running = this.#running();
        this.element.classList.toggle("no-source", !running);
        this.one.disabled = !running || this.entries.length >= MOST;
        this.three.disabled = !running || this.#counting || this.entries.length > MOST - 3;
        setLabel(this.one, this.#counting ? words.captureCancel : words.capture);
        if (!running) {
            if (this.#counting) this.#cancel();
            setText(this.counter, words.noSource);
            return;
        }
        if (!this.#counting) setText(this.counter, "");
        const { videoWidth: width, videoHeight: height } = this.video;
        if (this.preview.width !== 320) this.preview.width = 320;
        const tall = Math.round((320 * height) / width);
        if (this.preview.height !== tall) this.preview.height = tall;
        this.preview.getContext("2d").drawImage(this.video, 0, 0, 320, tall);
    }

    #cancel() {
        this.#run += 1;
        this.#counting = false;
        setText(this.counter, "");
    }

    async #take(count) {
        const run = ++this.#run;
        this.#counting = true;
        for (let left = COUNT_FROM; left > 0; left -= 1) {
            setText(this.counter, words.countdown(left));
            await wait(COUNT_MS);
            if (run !== this.#run) return;
        }
        for (let taken = 0; taken < count; taken += 1) {
            if (taken) await wait(BETWEEN_MS);
            if (run !== this.#run) return;
            const blob = await this.grab();
            if (run !== this.#run) return;
            if (blob) this.#add(blob);
        }
        this.#counting = false;
        setText(this.counter, "");
    }

    async #add(blob) {
        const take = new Take(blob, () => {
            this.entries = this.entries.filter((other) => other !== take);
            take.close();
            this.#draw();
            this.one.focus();
        });
        this.entries.push(take);
        this.onTaken();
        this.#draw();
        try {
            const answer = await this.check(blob);
            const likely = (answer.confusions || []).find(({ level, active }) => level === "likely" && active !== false);
            const other = likely ? likely.gesture : null;
            take.judged(answer.images[0], other);
            setText(this.note, other ? words.resembles(other) : "");
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            take.failed(describeError(error));
        }
    }

    #draw() {
        this.list.replaceChildren(
            ...this.entries.map(({ element, remove }, index) => {
                remove.setAttribute("aria-label", words.removeStill(index + 1));
                return element;
            }),
        );
        if (!this.entries.length) setText(this.note, "");
    }
}
