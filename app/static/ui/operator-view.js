// The operator's own picture with the hand that was found, and where it comes from.

import { texts } from "../texts/texts.js";
import { bitmapFromBase64, button, colour, el, icon, part, setHidden, setText, want } from "./dom.js";

const words = texts.operator;
const STALE_MS = 600;

/** The box and the mask's shade, drawn over the video in the frame's own pixels. */
class Overlay {
    constructor(canvas) {
        this.canvas = canvas;
        this.context = canvas.getContext("2d");
        this.tint = document.createElement("canvas");
        this.mask = false;
    }

    setMask(bitmap, colour) {
        this.mask = Boolean(bitmap);
        if (!bitmap) return;
        const { tint } = this;
        tint.width = bitmap.width;
        tint.height = bitmap.height;
        const context = tint.getContext("2d", { willReadFrequently: true });
        context.drawImage(bitmap, 0, 0);
        bitmap.close();
        // White is hand: what is not hand is shaded, so that the hand keeps its own colours.
        const pixels = context.getImageData(0, 0, tint.width, tint.height);
        for (let at = 0; at < pixels.data.length; at += 4) {
            pixels.data[at + 3] = 255 - pixels.data[at];
        }
        context.putImageData(pixels, 0, 0);
        context.globalCompositeOperation = "source-in";
        context.fillStyle = colour;
        context.fillRect(0, 0, tint.width, tint.height);
        context.globalCompositeOperation = "source-over";
    }

    draw(width, height, roi, colour, recognised) {
        const { canvas, context } = this;
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        context.clearRect(0, 0, width, height);
        if (!Array.isArray(roi) || roi.length !== 4) return;
        if (this.mask) {
            context.globalAlpha = 0.55;
            context.drawImage(this.tint, 0, 0, width, height);
            context.globalAlpha = 1;
        }
        const [x, y, w, h] = roi;
        context.strokeStyle = "rgba(0, 0, 0, 0.55)";
        context.lineWidth = recognised ? 9 : 6;
        context.strokeRect(x, y, w, h);
        context.strokeStyle = colour;
        context.lineWidth = recognised ? 5 : 2.5;
        context.setLineDash(recognised ? [] : [10, 8]);
        context.strokeRect(x, y, w, h);
        context.setLineDash([]);
    }

    clear() {
        this.mask = false;
        this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    }
}

function choice(iconName, title, text, id, onclick) {
    return el(
        "button",
        { type: "button", class: "choice", id, onclick },
        icon(iconName),
        el("span", { class: "choice-title", text: title }),
        el("span", { class: "choice-words", text }),
    );
}

/** The ways to tell the robot what to do; also used by the "start driving" sheet. */
export function sourceChoices(element, prefix) {
    return [
        choice("camera", words.useCamera, words.useCameraWords, `${prefix}-camera`, () =>
            want(element, "source", { kind: "camera" }),
        ),
        choice("hand", words.trySynthetic, words.trySyntheticWords, `${prefix}-synthetic`, () =>
            want(element, "source", { kind: "synthetic" }),
        ),
        choice("keys", words.useKeys, words.useKeysWords, `${prefix}-keys`, () =>
            want(element, "source", { kind: "keys" }),
        ),
    ];
}

/** Why there is no picture, and what to do about it. */
export function sourceProblem(element, code) {
    const { title, words: text } = texts.sourceErrors[code] || texts.sourceErrors.failed;
    return [
        el(
            "div",
            { class: "problem", role: "alert" },
            el("p", { class: "problem-title", text: title }),
            el("p", { text }),
        ),
        el(
            "div",
            { class: "row" },
            button(texts.actions.retry, {
                id: "source-retry",
                class: "primary",
                onclick: () => want(element, "source", { kind: "again" }),
            }),
            button(words.trySynthetic, {
                id: "source-instead",
                onclick: () => want(element, "source", { kind: "synthetic" }),
            }),
        ),
    ];
}

/**
 * What to call cameras, [{label, facing}]: a phone's by the way they look, others as they are called.
 * Those of one name are numbered from the second on.
 */
export function cameraNames(cameras) {
    const facing = { user: words.front, environment: words.rear };
    const seen = new Map();
    return cameras.map((camera, index) => {
        const name = facing[camera.facing] || camera.label || words.otherCamera(index + 1);
        const count = (seen.get(name) || 0) + 1;
        seen.set(name, count);
        return count > 1 ? `${name} ${count}` : name;
    });
}

/** Fills the operator's card; returns the <video> that sources play in. */
export function operatorView(element, store) {
    const video = part(element, "video");
    const glass = part(element, "glass");
    const badge = part(element, "badge");
    const caption = part(element, "caption");
    const choices = part(element, "choices");
    const cameras = part(element, "cameras");
    const overlay = new Overlay(part(element, "overlay"));
    glass.setAttribute("role", "img");
    glass.setAttribute("aria-label", words.previewLabel);
    setText(badge, words.demonstration);

    part(element, "stop").addEventListener("click", () =>
        want(element, "source", { kind: "none" }),
    );
    cameras.addEventListener("change", () =>
        want(element, "source", { kind: "camera", deviceId: cameras.value }),
    );

    let drawn = null;
    store.watch(["source"], ({ source }) => {
        element.dataset.state = source.state;
        element.dataset.kind = source.kind || "";
        const look = `${source.state} ${source.error || ""}`;
        if (look !== drawn) {
            drawn = look;
            if (source.state === "none") {
                choices.replaceChildren(...sourceChoices(element, "choose"));
            } else if (source.state === "starting") {
                choices.replaceChildren(el("p", { class: "waiting", text: words.asking }));
            } else if (source.state === "error") {
                choices.replaceChildren(...sourceProblem(element, source.error));
            } else {
                choices.replaceChildren();
            }
        }
    });

    store.watch(["cameras", "source"], (state) => {
        const list = state.cameras;
        const usable = list.filter((camera) => camera.id);
        const names = cameraNames(usable);
        const options = usable.map(({ id }, index) => el("option", { value: id, text: names[index] }));
        const key = usable.map((camera) => camera.id + camera.label).join();
        if (cameras.dataset.key !== key) {
            cameras.dataset.key = key;
            cameras.replaceChildren(...options);
        }
        setHidden(cameras, state.source.kind !== "camera" || usable.length < 2);
        if (state.source.deviceId) cameras.value = state.source.deviceId;
    });

    function drawFrame(state) {
        const { frame } = state;
        const fresh = frame && performance.now() - state.frameAt < STALE_MS;
        if (!fresh || state.source.state !== "running") {
            overlay.clear();
            return;
        }
        const recognised = Boolean(state.gesture && state.gesture.phase !== "end");
        const line = recognised ? colour("--overlay-match") : colour("--overlay-found");
        overlay.draw(state.sender.width || 640, state.sender.height || 480, frame.roi, line, recognised);
    }

    let decoding = false;
    let lastDetail = null;
    async function drawDetail(detail) {
        if (decoding || detail === lastDetail) return;
        lastDetail = detail;
        decoding = true;
        const mask = detail.mask ? await bitmapFromBase64(detail.mask) : null;
        overlay.setMask(mask, colour("--overlay-mask"));
        decoding = false;
    }

    store.watch(["frame", "gesture", "source"], drawFrame);
    store.watch(["detail"], (state) => {
        if (state.detail) drawDetail(state.detail);
    });

    function drawCaption() {
        const state = store.state;
        const running = state.source.state === "running";
        if (performance.now() - state.frameAt >= STALE_MS) drawFrame(state);
        const clip = state.source.kind === "synthetic" && running;
        const shown = state.clipGesture;
        setHidden(caption, !clip || shown === undefined);
        setText(caption, shown ? words.shows(shown) : words.showsNothing);
        setHidden(badge, !clip);
    }
    setInterval(drawCaption, 200);
    store.watch(["source", "clipGesture"], drawCaption);
    return video;
}
