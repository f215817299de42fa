// From a playing <video> to JPEG frames on the operator link, newest first.

const IN_FLIGHT = 2;
const FORGET_MS = 1000; // an answer that has not come by then will not come
const WIDEST = 640;
const QUALITY = 0.8;
const BACKLOG_BYTES = 96 * 1024; // what may wait in the browser before frames are left out
const FALLBACK_INTERVAL_MS = 33;

function makeCanvas() {
    if (typeof OffscreenCanvas === "function") return new OffscreenCanvas(16, 16);
    return document.createElement("canvas");
}

function encodeJpeg(canvas, quality) {
    if (canvas.convertToBlob) return canvas.convertToBlob({ type: "image/jpeg", quality });
    return new Promise((resolve, reject) =>
        canvas.toBlob(
            (blob) => (blob ? resolve(blob) : reject(new Error("no JPEG encoder"))),
            "image/jpeg",
            quality,
        ),
    );
}

/** The picture size to send for a video of this size: at most 640 wide, never enlarged. */
export function sentSize(width, height) {
    const scale = Math.min(1, WIDEST / width, 720 / height);
    return [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
}

/** One still of `video` as a JPEG Blob; null before the first picture. */
export async function grabStill(video, quality = 0.92) {
    if (!video.videoWidth) return null;
    const canvas = makeCanvas();
    [canvas.width, canvas.height] = sentSize(video.videoWidth, video.videoHeight);
    canvas.getContext("2d").drawImage(video, 0, 0, canvas.width, canvas.height);
    return encodeJpeg(canvas, quality);
}

/**
 * Sends each new picture of the video while fewer than two wait for their answer. Call `answered`
 * with the `seq` of every `frame` and `error` message. `onSent(width, height)` tells the size.
 */
export class FrameSender {
    #link;
    #video;
    #canvas = makeCanvas();
    #context;
    #running = 0; // changes with every start and stop; old callbacks see that they are old
    #timer = 0;
    #seq = 0;
    #inFlight = new Map(); // seq -> {capturedMs, sentAt}
    #encoding = false;
    #fresh = null; // capture time of a picture that has not been sent

    constructor(link, video) {
        this.#link = link;
        this.#video = video;
        this.#context = this.#canvas.getContext("2d", { alpha: false });
        this.width = 0;
        this.height = 0;
        this.counts = { captured: 0, sent: 0, answered: 0, lost: 0 };
        this.latencyMs = null;
        this.sentTimes = [];
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
        this.latencyMs = null;
    }

    /** The server answered frame `seq`. Older ones were left out by it: the newest frame wins. */
    answered(seq) {
        const frame = this.#inFlight.get(seq);
        if (!frame) return null;
        for (const older of [...this.#inFlight.keys()]) {
            if (older <= seq) this.#inFlight.delete(older);
        }
        this.counts.answered += 1;
        const took = performance.now() - frame.capturedMs;
        this.latencyMs = this.latencyMs === null ? took : this.latencyMs * 0.8 + took * 0.2;
        if (this.#fresh !== null) this.#send();
        return took;
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
            this.counts.lost += 1;
        }
        if (this.#inFlight.size >= IN_FLIGHT || this.#link.waitingBytes > BACKLOG_BYTES) return;
        const video = this.#video;
        if (!video.videoWidth) return;
        const capturedMs = this.#fresh;
        const run = this.#running;
        this.#fresh = null;
        this.#encoding = true;
        try {
            const [width, height] = sentSize(video.videoWidth, video.videoHeight);
            if (this.#canvas.width !== width || this.#canvas.height !== height) {
                this.#canvas.width = width;
                this.#canvas.height = height;
            }
            this.#context.drawImage(video, 0, 0, width, height);
            const blob = await encodeJpeg(this.#canvas, QUALITY);
            const jpeg = await blob.arrayBuffer();
            if (run !== this.#running) return;
            const seq = this.#seq + 1;
            if (!this.#link.sendFrame(seq, capturedMs, jpeg)) return;
            this.#seq = seq;
            this.#inFlight.set(seq, { capturedMs, sentAt: performance.now() });
            this.sentTimes.push(performance.now());
            this.counts.sent += 1;
            this.width = width;
            this.height = height;
        } finally {
            this.#encoding = false;
        }
        if (this.#fresh !== null && this.#inFlight.size < IN_FLIGHT) this.#send();
    }
}
