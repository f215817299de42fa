// The operator's camera as a source of frames.

/** Why a source cannot run. `code` is one of the keys of the texts' `sourceErrors`. */
export class SourceError extends Error {
    constructor(code, cause) {
        super(code, { cause });
        this.code = code;
    }
}

const ERROR_CODES = {
    NotAllowedError: "denied",
    SecurityError: "denied",
    NotFoundError: "none",
    OverconstrainedError: "gone",
    NotReadableError: "busy",
    AbortError: "busy",
};

/** Which way a phone's camera looks, as far as the browser tells. */
function facingOf(device) {
    const can = device.getCapabilities ? device.getCapabilities() : {};
    return (can.facingMode && can.facingMode[0]) || null;
}

/**
 * A source has `kind`, `label`, `start(video)`, `stop()`, and tells `lost` (detail: {code}) when it
 * ends by itself. Synthetic operator and webcam are interchangeable.
 */
export class WebcamSource extends EventTarget {
    #stream = null;

    constructor(deviceId = "") {
        super();
        this.kind = "camera";
        this.deviceId = deviceId;
        this.label = "";
    }

    /** Why no camera can be had at all, or null. Browsers give cameras to safe pages only. */
    static obstacle() {
        if (!window.isSecureContext) return "insecure";
        if (!navigator.mediaDevices || !navigator.mediaDevices.getUserMedia) return "unsupported";
        return null;
    }

    /**
     * Cameras as [{id, label, facing}]; labels are empty before the first permission. `facing` is
     * "user" or "environment" on a phone whose browser tells, and null elsewhere.
     */
    static async list() {
        if (WebcamSource.obstacle() || !navigator.mediaDevices.enumerateDevices) return [];
        try {
            const devices = await navigator.mediaDevices.enumerateDevices();
            return devices
                .filter((device) => device.kind === "videoinput")
                .map((device) => ({ id: device.deviceId, label: device.label, facing: facingOf(device) }));
        } catch {
            return [];
        }
    }

    /** Ask for the camera and play it in `video`. Throws SourceError. */
    async start(video) {
        const obstacle = WebcamSource.obstacle();
        if (obstacle) throw new SourceError(obstacle);
        const wish = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
        if (this.deviceId) wish.deviceId = { exact: this.deviceId };
        else wish.facingMode = { ideal: "user" }; // of a phone's cameras the one that sees who drives
        try {
            this.#stream = await navigator.mediaDevices.getUserMedia({ video: wish, audio: false });
        } catch (error) {
            throw new SourceError(ERROR_CODES[error.name] || "failed", error);
        }
        const track = this.#stream.getVideoTracks()[0];
        this.label = track.label;
        this.deviceId = track.getSettings().deviceId || this.deviceId;
        const lost = (code) => this.dispatchEvent(new CustomEvent("lost", { detail: { code } }));
        track.addEventListener("ended", () => lost("unplugged"));
        video.removeAttribute("src");
        video.srcObject = this.#stream;
        video.muted = true;
        try {
            await video.play();
        } catch (error) {
            if (error.name === "AbortError") return; // stopped while it started
            this.stop();
            throw new SourceError("failed", error);
        }
    }

    stop() {
        if (!this.#stream) return;
        for (const track of this.#stream.getTracks()) track.stop(); // tells no `ended`
        this.#stream = null;
    }
}
