// From a playing <video> to JPEG frames on the operator link, newest first.

import { JpegEncoder } from "./jpeg.js";
import { SendPace } from "./send-pace.js";

const IN_FLIGHT = 2;
const FORGET_MS = 1000; // an answer that has not come by then will not come
const BACKLOG_BYTES = 96 * 1024; // what may wait in the browser before frames are left out
const FALLBACK_INTERVAL_MS = 33;

/**
 * Sends each new picture of the video while fewer than two wait for their answer. Call `answered`
 * with the `seq` of every `frame` and `error` message. How often, and how large and good a picture is
 * sent, follows from how soon it is answered. `width` and `height` are of the last one answered.
 */
export class FrameSender {
    #link;
    #video;
    #encoder = new JpegEncoder();
    #running = 0; // changes with every start and stop; old callbacks see that they are old
    #timer = 0;
    #seq = 0;
    #pace = new SendPace();
    #inFlight = new Map(); // seq -> {capturedMs, sentAt, width, height}
    #encoding = false;
    #fresh = null; // capture time of a picture that has not been sent

    constructor(link, video) {
        this.#link = link;
        this.#video = video;
        this.width = 0;
        this.height = 0;
        this.counts = { captured: 0, sent: 0, answered: 0, lost: 0 };
        this.latencyMs = null;
        this.sentTimes = [];
    }

    /** Which of the pace's LEVELS is in force; 0 is the best. */
    get level() {
        return this.#pace.level;
    }

    /** Frames sent in the last second. */
    get rate() {
        const since = performance.now() - 1000;
        this.sentTimes = this.sentTimes.filter((time) => time > since);
        return this.sentTimes.length;
    }

    start() {
        this.stop();
        const run = this.#running;
        const video = this.#video;
        if (video.requestVideoFrameCallback) {
            const next = (now, picture) => {
                if (run !== this.#running) return;
                video.requestVideoFrameCallback(next);
                this.#captured(picture.captureTime || now);
            };
            video.requestVideoFrameCallback(next);
        } else {
            let last = -1;
            this.#timer = setInterval(() => {
                if (video.readyState < 2 || video.currentTime === last) return;
                last = video.currentTime;
                this.#captured(performance.now());
            }, FALLBACK_INTERVAL_MS);
        }
    }

    stop() {
        this.#running += 1;
        clearInterval(this.#timer);
        this.#fresh = null;
        this.forget();
    }

    /** Nothing sent so far will be answered: the connection is another one. */
    forget() {
        this.#inFlight.clear();
        this.#pace.forget();
        this.latencyMs = null;
    }

    /**
     * The server answered frame `seq`. Older ones were left out by it: the newest frame wins.
     * Returns what is known of its sending ({capturedMs, sentAt}), or null.
     */
    answered(seq) {
        const frame = this.#inFlight.get(seq);
        if (!frame) return null;
        for (const older of [...this.#inFlight.keys()]) {
            if (older <= seq) this.#inFlight.delete(older);
        }
        this.counts.answered += 1;
        const now = performance.now();
        this.#pace.answered(frame.sentAt, now);
        this.width = frame.width;
        this.height = frame.height;
        const took = now - frame.capturedMs;
        this.latencyMs = this.latencyMs === null ? took : this.latencyMs * 0.8 + took * 0.2;
        if (this.#fresh !== null) this.#send();
        return frame;
    }

    #captured(time) {
        this.counts.captured += 1;
        this.#fresh = time;
        this.#send();
    }

    async #send() {
        if (this.#encoding || this.#fresh === null || !this.#link.isOpen) return;
        const now = performance.now();
        for (const [seq, frame] of this.#inFlight) {
            if (now - frame.sentAt < FORGET_MS) continue;
            this.#inFlight.delete(seq);
            this.#pace.answered(frame.sentAt, now);
            this.counts.lost += 1;
        }
        if (!this.#pace.isDue(now)) return;
        if (this.#inFlight.size >= IN_FLIGHT || this.#link.waitingBytes > BACKLOG_BYTES) return;
        const capturedMs = this.#fresh;
        const run = this.#running;
        this.#fresh = null;
        this.#encoding = true;
        this.#pace.begin(now);
        const { quality, halved } = this.#pace.wanted;
        try {
            const picture = await this.#encoder.encode(this.#video, quality, halved);
            if (!picture || run !== this.#running) return;
            const seq = this.#seq + 1;
            if (!this.#link.sendFrame(seq, capturedMs, picture.jpeg)) return;
            this.#seq = seq;
            const { width, height } = picture;
            const sentAt = performance.now();
            this.#inFlight.set(seq, { capturedMs, sentAt, width, height });
            this.sentTimes.push(sentAt);
            this.counts.sent += 1;
        } catch (error) {
            // A video that was just taken away gives no picture; anything else is worth knowing.
            if (run === this.#running && error.name !== "InvalidStateError") throw error;
        } finally {
            this.#encoding = false;
        }
        if (this.#fresh !== null && this.#inFlight.size < IN_FLIGHT) this.#send();
    }
}
