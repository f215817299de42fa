// The operator WebSocket: text messages both ways, webcam frames up.

import { CLIENT_MESSAGES, packFrame, parseMessage } from "./protocol.js";
import { ReconnectingSocket, socketUrl } from "./socket.js";

const SILENCE_MS = 2000; // `robot` messages come ten times a second or more

/**
 * Events: `state` (see ReconnectingSocket) and `message` (detail: one parsed server message).
 */
export class OperatorLink extends EventTarget {
    #socket;
    #tick = 0;

    constructor(path = "ws/operator") {
        super();
        this.#socket = new ReconnectingSocket(socketUrl(path), { silenceMs: SILENCE_MS });
        this.#socket.addEventListener("state", (event) => {
            if (event.detail.state === "open") this.#tick = 0; // another server, another clock
            this.dispatchEvent(new CustomEvent("state", { detail: event.detail }));
        });
        this.#socket.addEventListener("message", (event) => {
            const message = typeof event.detail === "string" ? parseMessage(event.detail) : null;
            if (!message) return;
            if (Number.isFinite(message.tick)) this.#tick = Math.max(this.#tick, message.tick);
            this.dispatchEvent(new CustomEvent("message", { detail: message }));
        });
    }

    get isOpen() {
        return this.#socket.isOpen;
    }

    get waitingBytes() {
        return this.#socket.waitingBytes;
    }

    /** Newest server tick seen on this connection. */
    get tick() {
        return this.#tick;
    }

    open() {
        this.#socket.open();
    }

    retryNow() {
        this.#socket.retryNow();
    }

    /** Send one text message; false when there is no connection. */
    send(type, fields = {}) {
        if (!CLIENT_MESSAGES.includes(type)) throw new TypeError(`unknown message type ${type}`);
        return this.#socket.send(JSON.stringify({ type, ...fields }));
    }

    /** Send one webcam frame; false when there is no connection. */
    sendFrame(seq, capturedMs, jpeg) {
        return this.#socket.send(packFrame(seq, capturedMs, this.#tick, jpeg));
    }
}
