// What was changed can be taken back: by the notice that tells of it, or by Ctrl+Z.

import { texts } from "../texts/texts.js";
import { isField } from "./dom.js";
import { describeError } from "./words.js";

const words = texts.undo;
const STAY_MS = 15000;
const MOST = 50;

/**
 * @param notices where it is told
 * @param undo takes back the change of an id; throws ApiError
 */
export class Undo {
    #done = []; // [{text, changes}], the newest last
    #busy = false;

    constructor({ notices, undo }) {
        this.notices = notices;
        this.undo = undo;
    }

    /** Something was changed: say so. `changes` are the ids to take it back by, in their order. */
    did(text, changes) {
        const entry = { text, changes: changes.filter(Boolean) };
        if (!entry.changes.length) {
            this.notices.show(text, { kind: "good", name: "undo" });
            return;
        }
        this.#done.push(entry);
        if (this.#done.length > MOST) this.#done.shift();
        const act = { label: words.undo, id: "undo", run: () => this.#takeBack(entry) };
        this.notices.show(text, { kind: "good", name: "undo", act, stayMs: STAY_MS });
    }

    /** Take back the newest change that was made on this page. */
    last() {
        const entry = this.#done.at(-1);
        if (entry) return this.#takeBack(entry);
        this.notices.show(words.nothing, { name: "undo" });
        return null;
    }

    /** Ctrl+Z (on a Mac ⌘Z) anywhere but in a field, which has an undo of its own. Gives what ends it. */
    listen(target) {
        const down = (event) => {
            const { ctrlKey, metaKey, shiftKey, altKey, key } = event;
            if (!(ctrlKey || metaKey) || shiftKey || altKey || key.toLowerCase() !== "z") return;
            if (isField(event.target)) return;
            event.preventDefault();
            if (!event.repeat) this.last();
        };
        target.addEventListener("keydown", down);
        return () => target.removeEventListener("keydown", down);
    }

    async #takeBack(entry) {
        if (this.#busy || !this.#done.includes(entry)) return;
        this.#busy = true;
        try {
            // The newest first; what is done stays done when a later one is refused.
            while (entry.changes.length) {
                await this.undo(entry.changes.at(-1));
                entry.changes.pop();
            }
            this.#forget(entry);
            this.notices.show(words.done(entry.text), { kind: "good", name: "undo" });
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            if (error.status === 404) this.#forget(entry);
            this.notices.show(describeError(error), { kind: "bad", name: "undo" });
        } finally {
            this.#busy = false;
        }
    }

    #forget(entry) {
        this.#done = this.#done.filter((other) => other !== entry);
    }
}
