// Pictures of a <video> as JPEG bytes.

const WIDEST = 640;
const TALLEST = 720;
const WORKING_SIDE = 180; // the server makes no picture smaller: pipeline.decode.working_side

/**
 * The picture size to send for a video of this size: at most 640 wide, never enlarged. `halved` is
 * half of that, where the server would halve it anyway.
 */
export function sentSize(width, height, halved = false) {
    let scale = Math.min(1, WIDEST / width, TALLEST / height);
    if (halved && Math.floor(Math.min(width, height) * scale) / 2 >= WORKING_SIDE) scale /= 2;
    return [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
}

/** The video's picture now, to hand to the worker. A VideoFrame is not copied; a bitmap is. */
function take(video) {
    if (typeof VideoFrame === "function") {
        try {
            return new VideoFrame(video);
        } catch {
            // Some browsers make none from some videos.
        }
    }
    return createImageBitmap(video);
}

/** Encodes one picture at a time, in a worker where the browser can, else on the page's thread. */
export class JpegEncoder {
    #worker = null;
    #waiting = null;
    #canvas = null;

    constructor() {
        if (typeof OffscreenCanvas !== "function" || typeof Worker !== "function") return;
        try {
            this.#worker = new Worker(new URL("./jpeg-worker.js", import.meta.url));
        } catch {
            return;
        }
        this.#worker.onmessage = ({ data }) => this.#answer(data);
        this.#worker.onerror = (event) => {
            event.preventDefault();
            this.#answer({ error: "the worker did not load" });
        };
    }

    /** The video's picture now as {jpeg: ArrayBuffer, width, height}; null before the first one. */
    async encode(video, quality, halved = false) {
        if (!video.videoWidth || video.readyState < 2) return null;
        const [width, height] = sentSize(video.videoWidth, video.videoHeight, halved);
        if (this.#worker) {
            const picture = await take(video);
            const answered = new Promise((resolve) => {
                this.#waiting = resolve;
            });
            this.#worker.postMessage({ picture, width, height, quality }, [picture]);
            const { jpeg } = await answered;
            if (jpeg) return { jpeg, width, height };
            this.#worker.terminate(); // this browser's workers cannot do it
            this.#worker = null;
        }
        return { jpeg: await this.#encodeHere(video, width, height, quality), width, height };
    }

    close() {
        if (this.#worker) this.#worker.terminate();
        this.#worker = null;
    }

    #answer(data) {
        const resolve = this.#waiting;
        this.#waiting = null;
        if (resolve) resolve(data);
    }

    async #encodeHere(video, width, height, quality) {
        this.#canvas ||= document.createElement("canvas");
        const canvas = this.#canvas;
        if (canvas.width !== width) canvas.width = width;
        if (canvas.height !== height) canvas.height = height;
        canvas.getContext("2d", { alpha: false }).drawImage(video, 0, 0, width, height);
        const blob = await new Promise((resolve) =>
            canvas.toBlob(resolve, "image/jpeg", quality),
        );
        if (!blob) throw new Error("this browser cannot make JPEG pictures");
        return blob.arrayBuffer();
    }
}

/** Stills of good quality, one after another. */
export class Stills {
    #encoder = new JpegEncoder();
    #last = Promise.resolve();

    /** The video's picture as a JPEG Blob, taken when those asked for before are; null before the first. */
    take(video, quality = 0.92) {
        const taken = this.#last.then(async () => {
            const still = await this.#encoder.encode(video, quality);
            return still && new Blob([still.jpeg], { type: "image/jpeg" });
        });
        this.#last = taken.catch(() => {});
        return taken;
    }

    close() {
        this.#last.then(() => this.#encoder.close());
    }
}

/** One still of `video` as a JPEG Blob; null before the first picture. */
export async function grabStill(video, quality = 0.92) {
    const stills = new Stills();
    try {
        return await stills.take(video, quality);
    } finally {
        stills.close();
    }
}
