// Where the time of one frame goes: from the webcam to the arm, and back as a picture of it.

const WINDOW_MS = 2000; // medians are taken over so long
const KEPT = 256; // samples of a part; more than a window's at sixty frames a second, two cameras
const KEPT_FRAMES = 256; // a motion is told of well before so many more were answered
const KEPT_MOTIONS = 5;

/** The parts of the way, in their order. */
export const PARTS = Object.freeze(["encode", "up", "wait", "recognise", "motion", "picture"]);

function median(values) {
    const sorted = [...values].sort((a, b) => a - b);
    const middle = sorted.length >> 1;
    return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

/**
 * Told of every frame that was answered, of the robot's motions and of the pictures of it that were
 * shown, it says how long each part of the way takes:
 *
 * - `encode`: from capture until the frame was handed to the connection (this page's clock)
 * - `up`: until the server had it; `wait`: until a thread took it; `recognise`: until its command
 *   went out. What was spent in the server is in the frame's `timing_ms`; when it was done is its
 *   `tick`, which `clock.serverWhen` puts on this page's clock
 * - `motion`: until the motion began that the frame caused (the robot's `seq` and `seq_tick`)
 * - `picture`: from what a picture shows (the state of its tick) until it was drawn
 *
 * All times are in ms on performance.now().
 */
export class Latency {
    #clock;
    #samples = new Map(PARTS.map((name) => [name, []])); // name -> [{at, ms}]
    #doneAt = new Map(); // seq -> server's tick when its command went out
    #motion = null; // seq_tick of the newest motion known
    #pictures = new Map(); // camera -> {takenAt, shownAt}

    constructor(clock) {
        this.#clock = clock;
    }

    /** Another connection: another way, and frames that nobody knows there. */
    forget() {
        for (const samples of this.#samples.values()) samples.length = 0;
        this.#doneAt.clear();
        this.#pictures.clear();
        this.#motion = null;
    }

    /** A `frame` message came, and what is known of its sending: {capturedMs, sentAt} or null. */
    frame({ seq, tick, timing_ms: timing }, sent, now) {
        if (!timing || !Number.isFinite(timing.total)) return;
        const wait = timing.wait || 0;
        this.#doneAt.set(seq, tick);
        if (this.#doneAt.size > KEPT_FRAMES) {
            this.#doneAt.delete(this.#doneAt.keys().next().value);
        }
        this.#add("wait", wait, now);
        this.#add("recognise", timing.total - wait, now);
        if (!sent) return;
        this.#add("encode", sent.sentAt - sent.capturedMs, now);
        const done = this.#clock.serverWhen(tick);
        if (done !== null) this.#add("up", done - timing.total - sent.sentAt, now);
    }

    /** A `robot` message came; `mine`: its motions come of this page's frames. */
    robot({ seq, seq_tick: began }, mine, now) {
        if (!mine || !Number.isFinite(began) || began === this.#motion) return;
        const done = this.#doneAt.get(seq);
        const at = this.#clock.when(began);
        if (done === undefined || at === null) return; // the frame's own message may come later
        this.#motion = began;
        this.#add("motion", at - this.#clock.serverWhen(done), now);
    }

    /** A picture of the robot was drawn. */
    picture(camera, { takenAt, shownAt }) {
        this.#pictures.set(camera, { takenAt, shownAt });
        this.#add("picture", shownAt - takenAt, shownAt);
    }

    /**
     * {parts: [{name, ms}], total, whole, pictureAge}, whole ms; `ms` is null where nothing is known,
     * and left out of `total`; `whole`: all parts are known. `pictureAge` is that of the newest
     * picture of `camera`, or of any when that one shows none; null before the first.
     */
    reading(now, camera = null) {
        const parts = PARTS.map((name) => {
            // Frames follow one another; a motion begins now and then, and its time stays true.
            const lasts = name === "motion" ? Infinity : WINDOW_MS;
            const samples = this.#samples.get(name).filter(({ at }) => now - at <= lasts);
            const ms = samples.length ? Math.round(median(samples.map((each) => each.ms))) : null;
            return { name, ms };
        });
        const known = parts.filter(({ ms }) => ms !== null);
        const shown = this.#pictures.get(camera);
        const fresh = shown && now - shown.shownAt < WINDOW_MS;
        const newest = Math.max(...[...this.#pictures.values()].map(({ takenAt }) => takenAt));
        const takenAt = fresh ? shown.takenAt : newest;
        return {
            parts,
            total: known.length ? known.reduce((sum, { ms }) => sum + ms, 0) : null,
            whole: known.length === PARTS.length,
            pictureAge: Number.isFinite(takenAt) ? Math.max(0, Math.round(now - takenAt)) : null,
        };
    }

    #add(name, ms, at) {
        if (!Number.isFinite(ms)) return;
        const samples = this.#samples.get(name);
        // The clocks are known to some ms: what would be less than nothing is nothing.
        samples.push({ at, ms: Math.max(0, ms) });
        if (samples.length > (name === "motion" ? KEPT_MOTIONS : KEPT)) samples.shift();
    }
}
