// Which gesture is taught now, and what became of the others. No page here.

import { active, untaught } from "./plan.js";

export class Round {
    #index;
    #taught = new Set();
    #last = null; // id of the gesture that was dealt with last

    /** All that can be shown; those that were taught or skipped before count as such. */
    constructor(gestures, progress) {
        const open = new Set(untaught(gestures, progress).map(({ id }) => id));
        this.gestures = active(gestures);
        this.status = new Map(
            this.gestures.map(({ id, taught }) => [
                id,
                open.has(id) ? "open" : taught ? "taught" : "skipped",
            ]),
        );
        for (const [id, status] of this.status) if (status === "taught") this.#taught.add(id);
        this.#index = this.#nextOpen(0);
    }

    /** The gesture to show now; null when none is left. */
    get current() {
        return this.gestures[this.#index] || null;
    }

    get isOver() {
        return this.current === null;
    }

    get canGoBack() {
        return this.#index > 0;
    }

    get canRedo() {
        return this.#last !== null;
    }

    count(status) {
        return [...this.status.values()].filter((one) => one === status).length;
    }

    /** The current one is dealt with ("taught" or "skipped"); on to the next that is open. */
    settle(status) {
        const { current } = this;
        if (!current) return;
        if (status === "taught") this.#taught.add(current.id);
        // To skip one that is taught leaves it so.
        this.status.set(current.id, this.#taught.has(current.id) ? "taught" : status);
        this.#last = current.id;
        const after = this.#nextOpen(this.#index + 1);
        this.#index = after < this.gestures.length ? after : this.#nextOpen(0);
    }

    /** Go to a gesture, to show it (again). */
    goTo(id) {
        const index = this.gestures.findIndex((gesture) => gesture.id === id);
        if (index < 0) return;
        this.#index = index;
        this.status.set(id, "open");
    }

    back() {
        if (this.canGoBack) this.goTo(this.gestures[this.#index - 1].id);
    }

    /** Once more the one that was dealt with last. */
    redo() {
        if (this.#last !== null) this.goTo(this.#last);
    }

    #nextOpen(from) {
        const found = this.gestures.findIndex(
            ({ id }, index) => index >= from && this.status.get(id) === "open",
        );
        return found < 0 ? this.gestures.length : found;
    }
}
