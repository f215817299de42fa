// The robot's own description: its limits and poses.

const ASK_EVERY_MS = 3000;

/** Asks for the description again and again until the robot answers; puts it into the store. */
export class Describer {
    #api;
    #store;
    #askedAt = -Infinity;

    constructor(api, store) {
        this.#api = api;
        this.#store = store;
    }

    /** Another robot may answer now. */
    restart() {
        this.#askedAt = -Infinity;
    }

    async ask(robot, now = performance.now()) {
        if (!robot || now - this.#askedAt < ASK_EVERY_MS) return;
        this.#askedAt = now;
        try {
            const answer = await this.#api.robot(robot);
            const description = answer && (answer.description || answer);
            if (description && Array.isArray(description.joints) && description.poses) {
                this.#askedAt = Infinity;
                this.#store.set({ description });
            }
        } catch {
            // Not there yet; the read-out does without limits until then.
        }
    }
}
