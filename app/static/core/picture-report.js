// Which pictures of the robot its driver sees: the robot holds still when they are old.

const REPORT_EVERY_MS = 250;

/** Keeps what is known of the newest picture that was drawn, and tells the server while driving. */
export class PictureReport {
    /** By camera: {tick, takenAt, shownAt}. */
    shown = {};
    #reported = {};

    /**
     * @param {object} link sends messages.
     * @param {object} feeds the robot's cameras, by name.
     * @param {() => boolean} drives whether this page drives now.
     * @param {(camera: string, shown: object) => void} told is called with each picture.
     */
    constructor(link, feeds, drives, told) {
        for (const [name, feed] of Object.entries(feeds)) {
            feed.addEventListener("picture", ({ detail }) => {
                const { tick, takenAt } = detail;
                this.shown[name] = { tick, takenAt, shownAt: performance.now() };
                told(name, this.shown[name]);
            });
        }
        setInterval(() => {
            if (!drives()) return;
            for (const [camera, { tick }] of Object.entries(this.shown)) {
                if (this.#reported[camera] === tick) continue;
                this.#reported[camera] = tick;
                link.send("picture", { camera, tick });
            }
        }, REPORT_EVERY_MS);
    }

    /** The server has heard of none yet. */
    restart() {
        this.#reported = {};
    }
}
