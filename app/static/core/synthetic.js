// The synthetic operator: a clip of a drawn hand, played as if it were a camera.

import { SourceError } from "./webcam.js";

/** Same interface as WebcamSource. */
export class SyntheticSource extends EventTarget {
    #video = null;
    #onEnded = () => this.#again();
    #onError = () =>
        this.dispatchEvent(new CustomEvent("lost", { detail: { code: "clip" } }));

    constructor(path = "static/media/operator.webm") {
        super();
        this.kind = "synthetic";
        this.label = "";
        this.path = path;
    }

    /** Play the clip in `video`, over and over. Throws SourceError. */
    async start(video) {
        this.#video = video;
        video.srcObject = null;
        video.loop = true;
        video.muted = true;
        video.src = new URL(this.path, document.baseURI).href;
        try {
            await video.play();
        } catch (error) {
            if (error.name === "AbortError") return; // stopped while it started
            this.stop();
            throw new SourceError("clip", error);
        }
        // Some WebM files say no length and end in spite of `loop`.
        video.addEventListener("ended", this.#onEnded);
        video.addEventListener("error", this.#onError);
    }

    stop() {
        const video = this.#video;
        this.#video = null;
        if (!video) return;
        video.removeEventListener("ended", this.#onEnded);
        video.removeEventListener("error", this.#onError);
        video.pause();
        video.loop = false;
        video.removeAttribute("src");
        video.load();
    }

    #again() {
        if (!this.#video) return;
        this.#video.currentTime = 0;
        this.#video.play().catch(this.#onError);
    }
}
