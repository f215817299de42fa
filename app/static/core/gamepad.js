// A gamepad in the standard layout of the Gamepad specification (W3C, section "Remapping").

const READ_EVERY_MS = 33;
const DEAD = 0.25; // a stick that is pushed less rests: cheap ones do not come back to the middle
const SLOWEST = 0.05;
const [LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y] = [0, 1, 2, 3];
const [A, B, X, Y, L1, R1] = [0, 1, 2, 3, 4, 5];

/**
 * What a pad asks for: {enabled, move, scale, stop}. Nothing moves unless a shoulder button is held
 * (`enabled`): a pad that lies on the table or is knocked moves nothing. Of two sticks and two ways
 * the one pushed farthest counts, so that the arm goes straight.
 */
export function readPad({ axes, buttons }) {
    const down = (index) => Boolean(buttons[index] && buttons[index].pressed);
    const enabled = down(L1) || down(R1);
    const rest = { enabled, move: null, scale: 1, stop: down(B) };
    if (!enabled) return rest;
    if (down(A)) return { ...rest, move: "close" };
    if (down(X)) return { ...rest, move: "open" };
    if (down(Y)) return { ...rest, move: "home" };
    const ways = [
        [axes[LEFT_Y], "back", "forward"],
        [axes[LEFT_X], "right", "left"],
        [axes[RIGHT_Y], "down", "up"],
        [axes[RIGHT_X], "turn-right", "turn-left"],
    ];
    const [value, positive, negative] = ways.reduce((most, each) =>
        Math.abs(each[0] || 0) > Math.abs(most[0] || 0) ? each : most,
    );
    const pushed = Math.abs(value || 0);
    if (!(pushed > DEAD)) return rest;
    const scale = Math.max(SLOWEST, Math.min(1, (pushed - DEAD) / (1 - DEAD)));
    return { ...rest, move: value > 0 ? positive : negative, scale };
}

/** Reads the pads while `isWanted()`; calls `act` with what the first one asks for, or with null. */
export class GamepadReader {
    constructor(isWanted, act) {
        this.isWanted = isWanted;
        this.act = act;
        this.had = false;
        if (navigator.getGamepads) setInterval(() => this.#read(), READ_EVERY_MS);
    }

    #read() {
        const wanted = this.isWanted();
        const pad = wanted ? [...navigator.getGamepads()].find((each) => each && each.connected) : null;
        if (!pad && !this.had) return;
        this.had = Boolean(pad);
        this.act(pad ? readPad(pad) : null);
    }
}
