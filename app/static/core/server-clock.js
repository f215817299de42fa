// The clocks of server and robot, as seen from this page.

const PING_EVERY_MS = 500; // a sign of life, too: who drives and is silent for 2 s loses control
const FIRST_PINGS = 4;
const FIRST_PING_EVERY_MS = 250;
const KEPT = 64; // answers, half a minute's

/**
 * Estimates when, on this page's clock, the robot's clock showed a tick. Of the last answers to
 * pings the quickest one counts, because it waited least: the server is taken to have answered in
 * the middle of its way (the clock filter of NTP, RFC 5905, section 10). So the estimate is wrong by
 * half of that way's difference there and back, and never by more than half of the way.
 */
export class ServerClock {
    #link;
    #answers = []; // [{took, ahead}]: ms there and back; server's clock minus the page's
    #robotAhead = null; // robot's clock minus the server's
    #pings = 0;
    #timer = 0;

    constructor(link) {
        this.#link = link;
        link.addEventListener("state", () => this.#forget());
        link.addEventListener("message", ({ detail }) => this.#hear(detail, performance.now()));
    }

    /** ms there and back at the quickest; null before the first answer. */
    get roundTripMs() {
        return this.#answers.length ? this.#quickest().took : null;
    }

    /** When the robot's clock showed `tick`, on performance.now(); null while that is not known. */
    when(tick) {
        if (!this.#answers.length || this.#robotAhead === null) return null;
        return tick - this.#robotAhead - this.#quickest().ahead;
    }

    /** When the server's clock showed `tick`, on performance.now(); null while that is not known. */
    serverWhen(tick) {
        return this.#answers.length ? tick - this.#quickest().ahead : null;
    }

    #quickest() {
        return this.#answers.reduce((best, each) => (each.took < best.took ? each : best));
    }

    #forget() {
        clearTimeout(this.#timer);
        this.#answers = []; // another connection may lead to another server
        this.#robotAhead = null;
        this.#pings = 0;
    }

    #hear(message, now) {
        if (message.type === "hello") this.#ping();
        else if (message.type === "pong" && Number.isFinite(message.tick)) {
            const took = now - message.t;
            if (!(took >= 0)) return;
            this.#answers.push({ took, ahead: message.tick - (now - took / 2) });
            if (this.#answers.length > KEPT) this.#answers.shift();
        } else if (message.type === "robot" && Number.isFinite(message.state_tick)) {
            this.#robotAhead = message.state_tick + message.age_ms - message.tick;
        }
    }

    #ping() {
        if (!this.#link.send("ping", { t: performance.now() })) return;
        this.#pings += 1;
        const wait = this.#pings < FIRST_PINGS ? FIRST_PING_EVERY_MS : PING_EVERY_MS;
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.#ping(), wait);
    }
}
