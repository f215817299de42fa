// The webcam's picture as in a mirror, with the hand that was found and a ring that fills.

import { texts } from "../../texts/texts.js";
import { colour, el } from "../dom.js";

const WIDTH = 480;

export class Glass {
    #store;
    #video;
    #canvas = el("canvas", { "aria-hidden": "true", width: WIDTH, height: 360 });

    /** `corner`: an element that lies over the picture's corner, or null. */
    constructor(store, video, corner = null) {
        this.#store = store;
        this.#video = video;
        this.element = el(
            "div",
            { class: "first-glass", role: "img", "aria-label": texts.operator.previewLabel },
            this.#canvas,
            corner,
        );
    }

    /** Draw the picture of now; `box` in shares of it or null, `share` of the ring that is full. */
    draw(box, share = 0) {
        const video = this.#video;
        if (this.#store.state.source.state !== "running" || !video.videoWidth) return;
        const canvas = this.#canvas;
        const height = Math.round((WIDTH * video.videoHeight) / video.videoWidth);
        if (canvas.height !== height) canvas.height = height;
        const context = canvas.getContext("2d", { alpha: false });
        context.drawImage(video, 0, 0, WIDTH, height);
        if (!box) return;
        const [x, y, w, h] = [box[0] * WIDTH, box[1] * height, box[2] * WIDTH, box[3] * height];
        const radius = Math.max(40, Math.max(w, h) * 0.62);
        const ring = (colour, width, part) => {
            context.beginPath();
            // The canvas is mirrored, the ring is not to run backwards.
            context.arc(x + w / 2, y + h / 2, radius, -Math.PI / 2, -Math.PI / 2 - part * 2 * Math.PI, true);
            context.strokeStyle = colour;
            context.lineWidth = width;
            context.lineCap = "round";
            context.stroke();
        };
        ring("rgba(5, 8, 10, 0.55)", 10, 1);
        ring(colour("--overlay-found"), 2, 1);
        if (share > 0) ring(colour("--overlay-match"), 8, share);
    }
}
