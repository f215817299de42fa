// The state of the page: one flat object, changed only through set().

const EVERY_MS = 66;

/**
 * Listeners are told with a drawn picture, and fifteen times a second at most, however many messages
 * came in between: thirty answers and twenty states of the robot a second must not become fifty
 * layouts a second on a slow laptop. What comes after a pause is told with the next picture.
 */
export class Store {
    #state;
    #listeners = [];
    #dirty = new Set();
    #turn = 0; // the telling that is due; 0: none
    #turns = 0;
    #toldAt = -Infinity;

    constructor(initial) {
        this.#state = { ...initial };
    }

    /** The current values. Treat as read-only. */
    get state() {
        return this.#state;
    }

    /** Change some values; tells the listeners of those that really changed. */
    set(patch) {
        for (const [key, value] of Object.entries(patch)) {
            if (Object.is(this.#state[key], value)) continue;
            this.#state[key] = value;
            this.#dirty.add(key);
        }
        if (this.#dirty.size) this.#schedule();
    }

    /** Call `listener(state)` now, and again after any of `keys` changed. Gives what ends it. */
    watch(keys, listener) {
        const entry = { keys, listener };
        this.#listeners.push(entry);
        listener(this.#state);
        return () => {
            this.#listeners = this.#listeners.filter((other) => other !== entry);
        };
    }

    #schedule() {
        if (this.#turn) return;
        this.#turns += 1;
        const turn = this.#turn = this.#turns;
        const run = () => {
            if (turn !== this.#turn) return; // it was told, or the next one is not due yet
            this.#turn = 0;
            clearTimeout(hidden);
            this.#toldAt = performance.now();
            this.#flush();
        };
        const wait = this.#toldAt + EVERY_MS - performance.now();
        if (wait > 0) setTimeout(() => requestAnimationFrame(run), wait);
        else requestAnimationFrame(run);
        // Nothing is drawn while the page is hidden, but its state goes on.
        const hidden = setTimeout(run, 250);
    }

    #flush() {
        const dirty = this.#dirty;
        this.#dirty = new Set();
        for (const { keys, listener } of this.#listeners) {
            if (keys.some((key) => dirty.has(key))) listener(this.#state);
        }
    }
}
