// How many webcam frames go up, and how large: what the answers to them allow.

const BEAT_MS = 33; // of a webcam
const LATE_MS = 100; // an answer that comes this much later than the quickest one waited in a queue
const QUICK_MS = 50;
const LATE_IN_A_ROW = 2;
const STEADY_MS = 3000; // so long answers must be quick before more is tried
const MOSTLY = 0.9; // part of them: a busy computer holds one up now and then, at any level
const LONGEST_STEADY_MS = 60000;
const WINDOW_MS = 30000; // the quickest answer is that of this window and the one before it

/**
 * What to send, the best first: quality goes down first, then size, then rate. `halved` frames have
 * the size at which the server works anyway. At fewer than fifteen a second a gesture would be seen
 * late, and with one frame held up the command before it, which lives 250 ms, would end.
 */
export const LEVELS = Object.freeze([
    { quality: 0.8, halved: false, intervalMs: 0 },
    { quality: 0.6, halved: false, intervalMs: 0 },
    { quality: 0.7, halved: true, intervalMs: 0 },
    { quality: 0.5, halved: true, intervalMs: 0 },
    { quality: 0.5, halved: true, intervalMs: 66 },
]);

/**
 * Told of every frame that was sent and answered, it says which of LEVELS is in force. Goes down as
 * soon as two answers in a row were late against the quickest of the last minute (a long way is no
 * queue), and up a step when nearly all were quick for three seconds; a step that proves too much is
 * tried again after twice as long. What was under way at the first late answer was held up by the
 * same, and is not the second: a queue is still there for what is sent afterwards. The server paces its
 * pictures alike (app/gateway/picture_pace.py).
 * Times are in ms on performance.now().
 */
export class SendPace {
    #level = 0;
    #judgedFrom = -Infinity; // frames sent before this say nothing about the present level
    #windowFrom = -Infinity;
    #quickest = [Infinity, Infinity]; // of this window and the one before
    #late = 0;
    #lateFrom = -Infinity; // frames sent before this were held up by what was counted
    #answers = 0; // since the last step or look
    #quick = 0;
    #since = null;
    #steady = STEADY_MS;
    #raisedAt = -Infinity;
    #begunAt = -Infinity; // packing the frame before; what that takes is part of the interval

    get level() {
        return this.#level;
    }

    get wanted() {
        return LEVELS[this.#level];
    }

    /** Whether the next frame may be packed already. */
    isDue(now) {
        // Half a frame of grace: the webcam's beat and ours do not agree.
        return now - this.#begunAt >= this.wanted.intervalMs - BEAT_MS / 2;
    }

    /** A frame begins to be packed. */
    begin(now) {
        this.#begunAt = now;
    }

    /** A frame was answered, or given up. */
    answered(sentAt, now) {
        const took = now - sentAt;
        if (now - this.#windowFrom > WINDOW_MS) {
            this.#windowFrom = now;
            this.#quickest = [Infinity, this.#quickest[0]];
        }
        this.#quickest[0] = Math.min(this.#quickest[0], took);
        if (sentAt < this.#judgedFrom) return;
        const waited = took - Math.min(...this.#quickest);
        this.#since ??= now;
        this.#answers += 1;
        if (waited <= QUICK_MS) this.#quick += 1;
        if (waited <= LATE_MS) {
            this.#late = 0;
        } else if (sentAt >= this.#lateFrom) {
            this.#late += 1;
            this.#lateFrom = now;
        }
        if (this.#late >= LATE_IN_A_ROW) this.#lower(now);
        else if (now - this.#since >= this.#steady) this.#look(now);
    }

    /** Another connection, perhaps another way: what was quickest is not known any more. */
    forget() {
        this.#windowFrom = -Infinity;
        this.#quickest = [Infinity, Infinity];
        this.#judge();
    }

    #judge() {
        this.#late = 0;
        this.#lateFrom = -Infinity;
        this.#answers = 0;
        this.#quick = 0;
        this.#since = null;
    }

    /** Steady for long enough: were they quick? */
    #look(now) {
        if (this.#quick >= MOSTLY * this.#answers) this.#raise(now);
        else this.#judge();
    }

    #lower(now) {
        if (this.#level + 1 === LEVELS.length) return;
        if (now - this.#raisedAt < this.#steady) {
            this.#steady = Math.min(2 * this.#steady, LONGEST_STEADY_MS);
        }
        this.#go(this.#level + 1, now);
    }

    #raise(now) {
        if (now - this.#raisedAt > LONGEST_STEADY_MS) this.#steady = STEADY_MS;
        if (this.#level === 0) return this.#judge();
        this.#raisedAt = now;
        this.#go(this.#level - 1, now);
    }

    #go(level, now) {
        this.#level = level;
        this.#judgedFrom = now;
        this.#judge();
    }
}
