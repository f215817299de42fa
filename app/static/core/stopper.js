// Stop, and do not rest until the robot says that it has stopped.

const CONFIRM_MS = 300;
const TRIES = 6;
const TRY_TIMEOUT_MS = 1500;
const BETWEEN_MS = 400;

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * Sends `stop` over the WebSocket; when that is down or the robot has not said "stopped" within
 * 300 ms, also over REST, several times. Tells `state` (detail: "sending", "stopped" or "failed").
 */
export class Stopper extends EventTarget {
    #link;
    #api;
    #robot;
    #run = 0;
    #confirmed = false;

    constructor(link, api, robot) {
        super();
        this.#link = link;
        this.#api = api;
        this.#robot = robot; // () => id of the robot, or null while it is not known
        this.state = "idle";
        this.sent = 0;
    }

    /** Every `robot` message passes here. */
    saw(message) {
        if (message.mode === "stopped") {
            if (this.state === "sending" || this.state === "failed") this.#confirm();
        } else if (this.state === "stopped") {
            this.#tell("idle");
        }
    }

    async stop() {
        const run = ++this.#run;
        this.sent += 1;
        this.#confirmed = false;
        const overSocket = this.#link.send("stop"); // first of all, before anything is drawn
        this.#tell("sending");
        if (overSocket) await wait(CONFIRM_MS);
        for (let tries = 0; tries < TRIES; tries += 1) {
            if (this.#confirmed || run !== this.#run) return;
            if (await this.#post()) {
                if (run === this.#run && !this.#confirmed) this.#confirm();
                return;
            }
            await wait(BETWEEN_MS);
        }
        if (!this.#confirmed && run === this.#run) this.#tell("failed");
    }

    async #post() {
        try {
            let robot = this.#robot();
            if (!robot) {
                const robots = await this.#api.robots();
                robot = robots && robots[0] && robots[0].id;
            }
            if (!robot) return false;
            await this.#api.stopRobot(robot, TRY_TIMEOUT_MS);
            return true;
        } catch {
            return false;
        }
    }

    #confirm() {
        this.#confirmed = true;
        this.#tell("stopped");
    }

    #tell(state) {
        if (this.state === state && state !== "sending") return;
        this.state = state;
        this.dispatchEvent(new CustomEvent("state", { detail: state }));
    }
}
