// The order of the first minutes, and where somebody stands in it. No page here.

export const STEPS = Object.freeze(["source", "whose", "check", "teach", "drive"]);
const GESTURES_TO_SHOW = 2;

/**
 * What this browser remembers of one gallery's first minutes; what is taught, the server knows.
 * `past`: ids of gestures that were dealt with here, taught or skipped; `moved`: names of those that
 * moved the arm; `done`: gone through, or known already; `again`: what was taught is taught anew;
 * `left`: the hand is a left one.
 */
export const FRESH = Object.freeze({
    begun: false,
    checked: false,
    past: [],
    moved: [],
    stopped: false,
    done: false,
    again: false,
    left: false,
});

/** Progress from what was kept; anything else is none. */
export function readProgress(text) {
    let kept = null;
    try {
        kept = JSON.parse(text);
    } catch {
        // Not ours, or cut short.
    }
    if (!kept || typeof kept !== "object") return { ...FRESH };
    const list = (value) => (Array.isArray(value) ? value.filter((one) => typeof one === "string") : []);
    return {
        begun: kept.begun === true,
        checked: kept.checked === true,
        past: list(kept.past),
        moved: list(kept.moved),
        stopped: kept.stopped === true,
        done: kept.done === true,
        again: kept.again === true,
        left: kept.left === true,
    };
}

/** Gestures that can be shown to the robot, in their order. */
export const active = (gestures) => gestures.filter((gesture) => gesture.active !== false);

/** Gestures that are still to be taught. */
export function untaught(gestures, progress) {
    const { past, again } = progress;
    return active(gestures).filter(({ id, taught }) => (again || !taught) && !past.includes(id));
}

/** Whether what is taught changes nobody else's gestures, or there are no others' to change. */
export const isOwn = ({ gallery, galleries }) => !galleries || gallery !== "shared";

/** Whether somebody can go straight to driving: it was all done here, or with this gallery elsewhere. */
export function isReturning({ gallery, gestures }, progress) {
    if (progress.done || progress.again) return progress.done;
    const own = gallery && gallery !== "shared";
    return Boolean(own && active(gestures).length && active(gestures).every(({ taught }) => taught));
}

/**
 * The step at which somebody stands: one of STEPS, or "done".
 * @param {object} state of the page
 * @param {object} progress see FRESH
 * @param {boolean} asked whether it is known here whose hand it is
 */
export function stepNow(state, progress, asked) {
    if (state.source.state !== "running") return "source";
    if (state.source.kind === "keys") return "done"; // no hand to look at, none to teach
    // The drawn hand is nobody's, and shows what it likes.
    if (state.source.kind !== "synthetic") {
        if (state.galleries && !asked) return "whose";
        if (!progress.checked) return "check";
        if (isOwn(state) && untaught(state.gestures, progress).length) return "teach";
    }
    return progress.done ? "done" : "drive";
}

const axis = (action) => {
    const along = (action.linear || []).findIndex((speed) => speed);
    return action.type === "jog_cartesian" ? `linear ${along}` : action.type;
};

/** The gestures to show in the guided drive, best first: straight jogs in different directions. */
export function suggested(gestures, moved) {
    const rank = ({ action }) =>
        action.type === "jog_cartesian" ? (action.linear || [])[2] > 0 ? 0 : 1
        : action.type === "jog_joint" ? 2
        : 3;
    const able = active(gestures)
        .filter(({ action }) => action.type !== "stop")
        .sort((one, other) => rank(one) - rank(other));
    const done = able.filter(({ name }) => moved.includes(name)).map(({ action }) => axis(action));
    const fresh = able.filter(({ name }) => !moved.includes(name));
    return fresh.find(({ action }) => !done.includes(axis(action))) || fresh[0] || null;
}

/**
 * What the guided drive asks for now: "reset", "ask", "control", "arm", "show", "stop" or "done".
 * `drives`: whether this page holds the lease.
 */
export function driveTask(robot, drives, progress) {
    if (!robot || !robot.online || robot.fault) return "wait";
    if (robot.mode === "stopped") return "reset";
    if (progress.stopped) return "done";
    if (progress.moved.length >= GESTURES_TO_SHOW) return "stop";
    if (!drives) return robot.controller ? "ask" : "control";
    return robot.armed ? "show" : "arm";
}

/** Name of the gesture that moves the arm now, or null. */
export function movedBy({ robot, gesture }, drives) {
    const shown = gesture && gesture.phase !== "end" ? gesture.gesture : null;
    return drives && robot && robot.mode === "moving" && robot.action ? shown : null;
}

/**
 * Progress after what the robot does now; the same object when nothing was learnt.
 * `seen`: name of a gesture that moved the arm for long enough to be seen, or null
 */
export function learn({ robot }, seen, progress) {
    if (!robot) return progress;
    const shown = progress.moved.length >= GESTURES_TO_SHOW;
    if (shown && robot.mode === "stopped" && !progress.stopped) return { ...progress, stopped: true };
    if (shown || !seen || progress.moved.includes(seen)) return progress;
    return { ...progress, moved: [...progress.moved, seen] };
}
