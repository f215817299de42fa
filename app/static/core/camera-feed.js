// Pictures of one robot camera, newest first and only while wanted.

import { unpackPicture } from "./protocol.js";
import { ReconnectingSocket, socketUrl } from "./socket.js";

const MOST_HZ = 30;

/**
 * Events: `picture` (detail: {bitmap, seq, tick, takenAt}; the listener takes or closes the bitmap).
 * `takenAt` is on performance.now(): by `when(tick)`, or, while that is null, when it arrived.
 * A picture that arrives while another is being decoded replaces the one that waits. Each one that
 * was shown is acknowledged, so that the server sends no more than the way here carries.
 */
export class CameraFeed extends EventTarget {
    #socket;
    #newest = null;
    #decoding = false;
    #when;

    constructor(name, when = () => null) {
        super();
        this.#when = when;
        this.name = name;
        this.mostHz = MOST_HZ; // pictures a second that are wanted
        this.pictures = 0;
        this.failures = 0; // tries in a row that brought no picture
        this.#socket = new ReconnectingSocket(
            socketUrl(`ws/camera/${encodeURIComponent(name)}?acks=1`),
        );
        this.#socket.addEventListener("state", (event) => {
            if (event.detail.state === "waiting") this.failures += 1;
        });
        this.#socket.addEventListener("message", (event) => {
            const picture = unpackPicture(event.detail);
            if (!picture) return;
            this.#newest = { ...picture, arrivedAt: performance.now() };
            if (!this.#decoding) this.#decode();
        });
    }

    open() {
        this.#socket.open();
    }

    /** Try now, without waiting for the back-off. */
    retryNow() {
        this.#socket.retryNow();
    }

    close() {
        this.#newest = null;
        this.#socket.close();
    }

    async #decode() {
        this.#decoding = true;
        while (this.#newest) {
            const { jpeg, seq, tick, arrivedAt } = this.#newest;
            this.#newest = null;
            try {
                const bitmap = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" }));
                this.pictures += 1;
                this.failures = 0;
                const takenAt = Math.min(arrivedAt, this.#when(tick) ?? arrivedAt);
                const detail = { bitmap, seq, tick, takenAt };
                this.dispatchEvent(new CustomEvent("picture", { detail }));
            } catch {
                // A broken picture is no picture; its age will show.
            }
            // Broken or not: it is not on its way any more.
            this.#socket.send(JSON.stringify({ type: "shown", seq, most: this.mostHz }));
        }
        this.#decoding = false;
    }
}
