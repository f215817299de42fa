// Which source of frames runs: the webcam, the synthetic operator, or none.

import { SyntheticSource } from "./synthetic.js";
import { SourceError, WebcamSource } from "./webcam.js";

/** Keeps one source, in `video`, and the store's `source` and `cameras` true to it. */
export class SourceKeeper {
    #video;
    #store;
    #sender;
    #source = null;
    #last = { kind: "camera", deviceId: "" };
    #run = 0;

    constructor(video, store, sender) {
        this.#video = video;
        this.#store = store;
        this.#sender = sender;
        const devices = navigator.mediaDevices;
        if (devices && devices.addEventListener) {
            devices.addEventListener("devicechange", () => this.listCameras());
        }
    }

    async listCameras() {
        this.#store.set({ cameras: await WebcamSource.list() });
    }

    /** Start a source; kind is "camera", "synthetic", "keys" or "again" (what was tried last). */
    async start({ kind, deviceId = "" }) {
        if (kind !== "again") this.#last = { kind, deviceId };
        const wanted = this.#last;
        this.stop();
        const run = this.#run;
        if (wanted.kind === "keys") {
            this.#store.set({ source: { state: "running", kind: "keys" } });
            return;
        }
        const synthetic = wanted.kind === "synthetic";
        const source = synthetic ? new SyntheticSource() : new WebcamSource(wanted.deviceId);
        this.#source = source;
        source.addEventListener("lost", (event) => {
            if (this.#source === source) this.#failed(wanted.kind, event.detail.code);
        });
        this.#store.set({ source: { state: "starting", kind: wanted.kind } });
        try {
            await source.start(this.#video);
        } catch (error) {
            if (run !== this.#run) return;
            const code = error instanceof SourceError ? error.code : "failed";
            if (code === "gone") this.#last = { kind: "camera", deviceId: "" };
            this.#failed(wanted.kind, code);
            return;
        }
        if (run !== this.#run) {
            source.stop(); // another one was chosen while this one started
            return;
        }
        this.#sender.start();
        const { label, deviceId: id } = source;
        this.#store.set({ source: { state: "running", kind: wanted.kind, label, deviceId: id } });
        if (!synthetic) this.listCameras();
    }

    stop() {
        this.#end();
        this.#store.set({ source: { state: "none" } });
    }

    #failed(kind, code) {
        this.#end();
        this.#store.set({ source: { state: "error", kind, error: code } });
        this.listCameras();
    }

    #end() {
        this.#run += 1;
        this.#sender.stop();
        if (this.#source) this.#source.stop();
        this.#source = null;
        this.#video.srcObject = null;
    }
}
