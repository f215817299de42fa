// What the page needs of the browser and of the way to the server, tried out.

import { proofProtocols } from "./sign-in.js";
import { socketUrl } from "./socket.js";
import { SourceError, WebcamSource } from "./webcam.js";

const SOCKET_MS = 6000;

/** The camera, as starting it does: asks for permission if need be. "fine", or an error's code. */
async function camera() {
    const source = new WebcamSource();
    try {
        await source.start(document.createElement("video"));
        return "fine";
    } catch (error) {
        return error instanceof SourceError ? error.code : "failed";
    } finally {
        source.stop();
    }
}

/** Whether a WebSocket opens. Some proxies and filters let pages through, and these not. */
function webSocket(path) {
    return new Promise((resolve) => {
        const socket = new WebSocket(socketUrl(path), proofProtocols());
        const end = (code) => {
            clearTimeout(timer);
            socket.onopen = socket.onclose = null;
            socket.close();
            resolve(code);
        };
        const timer = setTimeout(() => end("blocked"), SOCKET_MS);
        socket.onopen = () => end("fine");
        socket.onclose = () => end("blocked");
    });
}

function webGl() {
    const context = document.createElement("canvas").getContext("webgl2");
    const ending = context && context.getExtension("WEBGL_lose_context");
    if (ending) ending.loseContext(); // browsers allow few at once
    return context ? "fine" : "off";
}

/**
 * Check all, one after another; `found` is called with {what, code} for each. `what` is "camera",
 * "socket" or "webgl"; `code` "fine" or a key of the texts. `running`: the camera is on already.
 */
export async function preflight(found, { running = false, path = "ws/camera/scene" } = {}) {
    found({ what: "socket", code: await webSocket(path) });
    found({ what: "camera", code: running ? "fine" : await camera() });
    found({ what: "webgl", code: webGl() });
}
