// What is held down now, to be done by the robot for as long as it is.

const SEND_EVERY_MS = 50; // a command lives 250 ms

/**
 * One thing is held at a time: what is pressed later takes its place, and letting that go ends it,
 * also while the first is still down. Sends a `jog` message at once when that changes and many times
 * a second while `start`ed, so that the robot holds still soon after this page has fallen silent.
 * Event: `change`.
 */
export class Held extends EventTarget {
    #link;
    #timer = 0;
    #hold = 0;
    #now = null; // {by, id, action, scale}

    constructor(link) {
        super();
        this.#link = link;
    }

    /** Id of what is held, or null. */
    get id() {
        return this.#now && this.#now.id;
    }

    get isOn() {
        return Boolean(this.#timer);
    }

    start() {
        if (this.#timer) return;
        this.#timer = setInterval(() => this.#send(), SEND_EVERY_MS);
        this.#send();
    }

    stop() {
        this.release();
        clearInterval(this.#timer);
        this.#timer = 0;
    }

    /**
     * `by` says what holds it (a key's code, a button, the gamepad), `id` what is done. `scale`, the
     * part of the speed, may change while the same is held.
     */
    press(by, { id, action }, scale = 1) {
        if (!this.#timer) return;
        if (this.#now && this.#now.by === by && this.#now.id === id) {
            this.#now.scale = scale;
            return;
        }
        this.#hold += 1;
        this.#now = { by, id, action, scale };
        this.#changed();
    }

    /** Let go of what `by` holds; without it, of everything. */
    release(by = null) {
        if (!this.#now || (by !== null && this.#now.by !== by)) return;
        this.#now = null;
        this.#changed();
    }

    #changed() {
        if (this.#timer) this.#send();
        this.dispatchEvent(new Event("change"));
    }

    #send() {
        const { tick } = this.#link;
        if (!tick) return; // nothing was heard of the server yet
        const { action = null, scale = 1 } = this.#now || {};
        this.#link.send("jog", { hold: this.#hold, action, scale, tick, at: performance.now() });
    }
}
