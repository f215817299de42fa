// A WebSocket that comes back.

import { proofProtocols } from "./sign-in.js";

const FIRST_DELAY_MS = 250;
const LONGER = 1.5; // each delay than the one before, and a fifth of it either way by chance
const LONGEST_DELAY_MS = 5000;
const OPENING_MS = 6000;
const DOUBT_MS = 2000; // an open socket that was silent for so long is tried anew when asked

/** The address of `path` on the page's own server, as ws: or wss:. */
export function socketUrl(path) {
    const url = new URL(path, document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    return url.href;
}

/**
 * Events: `state` (detail: {state, retryAt, code, reason}) where state is "closed", "connecting",
 * "open" or "waiting" (for the next try, at `retryAt` on performance.now()); and `message` (detail:
 * data).
 * A socket that says nothing for `silenceMs` counts as dead: a pulled plug sends no close. When the
 * browser says that the network is back, it is tried at once.
 */
export class ReconnectingSocket extends EventTarget {
    #url;
    #silenceMs;
    #socket = null;
    #wanted = false;
    #delay = FIRST_DELAY_MS;
    #timer = 0;
    #watch = 0;
    #heardAt = 0;

    constructor(url, { silenceMs = 0 } = {}) {
        super();
        this.#url = url;
        this.#silenceMs = silenceMs;
        this.state = "closed";
        // A try that began without a network may wait for seconds yet.
        window.addEventListener("online", () => {
            if (this.#wanted && this.state !== "open") this.#tryNow();
        });
    }

    get isOpen() {
        return this.#socket !== null && this.#socket.readyState === WebSocket.OPEN;
    }

    /** Bytes that the browser has not yet sent. */
    get waitingBytes() {
        return this.#socket ? this.#socket.bufferedAmount : 0;
    }

    open() {
        if (this.#wanted) return;
        this.#wanted = true;
        this.#delay = FIRST_DELAY_MS;
        this.#connect();
    }

    close() {
        this.#wanted = false;
        this.#drop();
        this.#tell("closed");
    }

    /** Try now, without waiting for the back-off; leaves alone what is open and alive. */
    retryNow() {
        if (!this.#wanted || this.state === "connecting") return;
        if (this.state === "open" && performance.now() - this.#heardAt < DOUBT_MS) return;
        this.#tryNow();
    }

    /** Send; false when the socket is not open. */
    send(data) {
        if (!this.isOpen) return false;
        this.#socket.send(data);
        return true;
    }

    #tryNow() {
        this.#delay = FIRST_DELAY_MS;
        this.#connect();
    }

    #connect() {
        this.#drop();
        this.#tell("connecting");
        const socket = new WebSocket(this.#url, proofProtocols());
        socket.binaryType = "arraybuffer";
        this.#socket = socket;
        this.#heardAt = performance.now();
        socket.onopen = () => {
            this.#heardAt = performance.now();
            this.#tell("open");
        };
        socket.onmessage = (event) => {
            this.#heardAt = performance.now();
            this.#delay = FIRST_DELAY_MS;
            this.dispatchEvent(new CustomEvent("message", { detail: event.data }));
        };
        socket.onclose = (event) => this.#lost(event.code, event.reason);
        this.#watch = setInterval(() => this.#checkSilence(), 500);
    }

    #checkSilence() {
        const quiet = performance.now() - this.#heardAt;
        const limit = this.state === "open" ? this.#silenceMs : OPENING_MS;
        if (limit && quiet > limit) this.#lost(0);
    }

    #lost(code, reason = "") {
        this.#drop();
        if (!this.#wanted) return;
        const wait = this.#delay * (0.8 + 0.4 * Math.random());
        this.#delay = Math.min(this.#delay * LONGER, LONGEST_DELAY_MS);
        this.#timer = setTimeout(() => this.#connect(), wait);
        this.#tell("waiting", { retryAt: performance.now() + wait, code, reason });
    }

    #drop() {
        clearTimeout(this.#timer);
        clearInterval(this.#watch);
        const socket = this.#socket;
        this.#socket = null;
        if (!socket) return;
        socket.onopen = socket.onmessage = socket.onclose = null;
        socket.close();
    }

    #tell(state, more = {}) {
        this.state = state;
        this.dispatchEvent(new CustomEvent("state", { detail: { state, ...more } }));
    }
}
