// How long something has been so: a check that stays good, a hand that is held still. No page here.

const LONGEST_GAP_MS = 500; // updates farther apart leave open what was in between

/** How long something has been true without a break, as a share of how long it should be. */
export class Steady {
    #since = null;
    #good = -Infinity;

    /** `graceMs`: a break that short is none. */
    constructor(needMs, graceMs = 200) {
        this.needMs = needMs;
        this.graceMs = graceMs;
    }

    /** The share, 0 to 1, at `now` (ms). */
    update(now, isGood) {
        const gap = now - this.#good;
        if (isGood) {
            if (this.#since === null || gap > LONGEST_GAP_MS) this.#since = now;
            this.#good = now;
        } else if (gap > this.graceMs) this.#since = null;
        if (this.#since === null) return 0;
        return Math.min(1, (this.#good - this.#since) / this.needMs);
    }

    reset() {
        this.#since = null;
        this.#good = -Infinity;
    }
}

/** When of a hold a picture is taken: spread, so that the pictures differ a little. */
export const MOMENTS = Object.freeze([0.4, 0.7, 1]);

/**
 * One gesture after another, each held still. The hand has to change before it counts: what was held
 * for the last gesture is not taken for the next one.
 *
 * `phase`: "change" (the hand is still as it was), "show" (no hand, or it moves), "hold" (it counts),
 * "taken". `due`: how many pictures should be taken by now; back to 0 when the hand moved in between.
 */
export class HoldStill {
    #steady;
    #changing = null;
    #phase = "change";

    constructor({ holdMs = 1000, changeMs = 200, graceMs = 200 } = {}) {
        this.#steady = new Steady(holdMs, graceMs);
        this.changeMs = changeMs;
    }

    get phase() {
        return this.#phase;
    }

    /** Wait for the next gesture. */
    next() {
        this.#phase = "change";
        this.#changing = null;
        this.#steady.reset();
    }

    /** @returns {{phase: string, share: number, due: number}} at `now` (ms) */
    update(now, { hand, still }) {
        if (this.#phase === "taken") return { phase: "taken", share: 1, due: MOMENTS.length };
        const resting = Boolean(hand && still);
        if (this.#phase === "change") {
            if (resting) this.#changing = null;
            else this.#changing ??= now;
            if (resting || now - this.#changing < this.changeMs) {
                return { phase: "change", share: 0, due: 0 };
            }
        }
        const share = this.#steady.update(now, resting);
        this.#phase = share >= 1 ? "taken" : share > 0 || resting ? "hold" : "show";
        const due = MOMENTS.filter((moment) => share >= moment).length;
        return { phase: this.#phase, share, due };
    }
}
