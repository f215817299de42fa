// The words and bytes of the WebSockets, as docs/protocol.md has them.

/** Types of the text messages that the page sends. */
export const CLIENT_MESSAGES = Object.freeze([
    "take_control",
    "release_control",
    "arm",
    "disarm",
    "stop",
    "reset",
    "view",
    "speed",
    "picture",
    "ping",
    "ask_control",
    "keep_control",
    "hand_over",
    "jog",
    "use_gallery",
]);

/** Types of the text messages that the server sends. */
export const SERVER_MESSAGES = Object.freeze([
    "hello",
    "frame",
    "gesture",
    "robot",
    "gallery",
    "people",
    "pong",
    "jog",
    "timeline",
    "error",
]);

/** Bytes in front of every picture: little-endian <2sBBIdQ. */
export const HEADER_SIZE = 24;
const MAGIC_F = 0x46;
const MAGIC_H = 0x48;
const VERSION = 1;

/**
 * One webcam frame as a binary message.
 * @param {number} seq counts the frames of this page
 * @param {number} capturedMs capture time on this page's monotonic clock
 * @param {number} tick newest tick of the server seen so far
 * @param {ArrayBuffer} jpeg
 * @returns {ArrayBuffer}
 */
export function packFrame(seq, capturedMs, tick, jpeg) {
    const message = new Uint8Array(HEADER_SIZE + jpeg.byteLength);
    const view = new DataView(message.buffer);
    view.setUint8(0, MAGIC_F);
    view.setUint8(1, MAGIC_H);
    view.setUint8(2, VERSION);
    view.setUint8(3, 0);
    view.setUint32(4, seq >>> 0, true);
    view.setFloat64(8, Math.max(0, capturedMs), true);
    view.setBigUint64(16, BigInt(Math.max(0, Math.trunc(tick) || 0)), true);
    message.set(new Uint8Array(jpeg), HEADER_SIZE);
    return message.buffer;
}

/**
 * A robot picture from a camera WebSocket; null when the bytes are not one.
 * @param {ArrayBuffer} message
 */
export function unpackPicture(message) {
    if (!(message instanceof ArrayBuffer) || message.byteLength <= HEADER_SIZE) return null;
    const view = new DataView(message);
    if (view.getUint8(0) !== MAGIC_F || view.getUint8(1) !== MAGIC_H) return null;
    if (view.getUint8(2) !== VERSION) return null;
    return {
        seq: view.getUint32(4, true),
        capturedMs: view.getFloat64(8, true),
        tick: Number(view.getBigUint64(16, true)),
        jpeg: new Uint8Array(message, HEADER_SIZE),
    };
}

/** A text message as an object with a string `type`; null when it is not one. */
export function parseMessage(text) {
    try {
        const message = JSON.parse(text);
        return message && typeof message.type === "string" ? message : null;
    } catch {
        return null;
    }
}
