// The one sentence that says what is happening and why.

import { asSentence, bare } from "../texts/forms.js";
import { texts } from "../texts/texts.js";
import { setText } from "./dom.js";
import { isDriving, isObserver, modeOf } from "./page.js";
import { describeAction, toldOf } from "./words.js";

const words = texts.sentence;
const STALE_FRAME_MS = 700;

function seen(state) {
    const gesture = state.gesture && state.gesture.phase !== "end" ? state.gesture.gesture : null;
    return gesture || null;
}

/** A gesture is held, and the arm stands. */
function whileStanding(state, gesture) {
    const why = state.robot.reason || state.frame.reason;
    if (why) return `${words.seen(gesture)} ${asSentence(toldOf(why, state.description))}`;
    // A jog does not end by itself: it is about to begin.
    const known = state.gestures.find(({ name }) => name === gesture);
    const over = known && !known.action.type.startsWith("jog_") && state.gesture.phase === "hold";
    return over ? words.done(gesture) : words.seen(gesture);
}

const byKeys = (state) => state.source.kind === "keys";

/** What the arm does not do by keys, and why not. */
function whileStandingByKeys(state) {
    const why = state.jog && state.jog.reason;
    return why ? asSentence(toldOf(why, state.description)) : words.readyKeys;
}

function whileDriving(state, now) {
    const { robot, frame } = state;
    if (state.source.state === "starting") return words.sourceStarting;
    if (state.source.state !== "running") return words.noSource;
    const gesture = seen(state);
    const limits = (robot.limits || []).map((each) => toldOf(each, state.description)).join(", ");
    if (robot.mode === "moving" && robot.action) {
        const what = describeAction(robot.action, state.description);
        const tail = limits ? ` ${words.limits(limits)}` : "";
        return (gesture ? words.movingHold(gesture, what) : words.moving(what)) + tail;
    }
    if (limits) return words.limits(limits);
    if (byKeys(state)) return whileStandingByKeys(state);
    if (!frame) return words.waitingPicture;
    if (now - state.frameAt > STALE_FRAME_MS) return words.noFrames;
    if (gesture) return whileStanding(state, gesture);
    return frame.reason ? asSentence(toldOf(frame.reason, state.description)) : words.ready;
}

const LATCH_LATE_MS = 1000; // an ordinary disk answers within milliseconds

/** What the disk does not know of a stop or its reset, or null. */
function whatIsNotKept({ robot, description }) {
    const latch = robot && robot.online ? robot.latch : null;
    if (!latch || !latch.reason) return null;
    if (latch.status !== "failed" && latch.waiting_ms <= LATCH_LATE_MS) return null;
    const why = toldOf(latch.reason, description);
    return robot.mode === "stopped" ? words.stopNotKept(why) : words.latchNotKept(why);
}

/** What is happening and why, in a few short sentences. */
export function sentenceFor(state, now) {
    const said = happening(state, now);
    const more = state.connection.state === "open" ? whatIsNotKept(state) : null;
    return more ? `${said} ${more}` : said;
}

function happening(state, now) {
    const link = state.connection.state;
    if (link === "signed-out") return words.signedOut;
    if (link !== "open") return state.hello ? words.gone : words.connecting;
    const { robot } = state;
    if (!robot) return words.noRobot;
    const mode = modeOf(state);
    const plain = bare(robot.reason); // as the robot says it
    const why = toldOf(plain, state.description);
    if (mode === "faulted") return words.fault(toldOf(bare(robot.fault), state.description) || words.faultUnknown);
    if (mode === "unknown") return words.noRobot;
    if (mode === "stopped") {
        return `${words.stopped(why)} ${isObserver(state) ? words.stoppedWatch : words.stoppedNext}`;
    }
    if (!isDriving(state)) {
        if (robot.controller) return words.otherDrives(robot.controller);
        if (isObserver(state)) return words.watching;
        if (state.source.state === "starting") return words.sourceStarting;
        if (state.source.state !== "running") return words.noSource;
        const gesture = seen(state);
        return gesture ? words.seenIdle(gesture, words.noControl) : words.noControl;
    }
    if (!robot.armed) {
        if (why && state.wasArmed) return words.disarmedWhy(why);
        const gesture = seen(state);
        if (byKeys(state)) return words.disarmedKeys;
        return gesture ? words.seenIdle(gesture, words.disarmed) : words.disarmed;
    }
    if (mode === "holding" && words.doubts[robot.doubt]) {
        const next = byKeys(state) ? words.holdingKeys : words.holdingNext;
        return `${words.holding(words.doubts[robot.doubt])} ${next}`;
    }
    if (mode === "holding" && byKeys(state)) {
        // The robot's own words for how to go on are about gestures.
        return `${words.holding(/gesture/.test(plain) ? "" : why)} ${words.holdingKeys}`;
    }
    if (mode === "holding") {
        // Some reasons say themselves how to go on.
        const next = /gesture/.test(plain) ? "" : ` ${words.holdingNext}`;
        return words.holding(why) + next;
    }
    return whileDriving(state, now);
}

const SHOW_EVERY_MS = 250; // figures in a reason change with every frame; eyes do not
const SPEAK_EVERY_MS = 2500;

/** `spoken` is read by screen readers, more rarely, and without its figures changing all the time. */
export function sentence(element, spoken, store) {
    let shownAt = 0;
    let spokenAt = 0;
    let timer = 0;

    function draw() {
        const now = performance.now();
        clearTimeout(timer);
        timer = 0;
        if (now - shownAt < SHOW_EVERY_MS) {
            timer = setTimeout(draw, SHOW_EVERY_MS - (now - shownAt));
            return;
        }
        const text = sentenceFor(store.state, now);
        if (text !== element.textContent) shownAt = now;
        setText(element, text);
        const gist = text.replace(/[\d.,]+\s?%/g, "").replace(/\s+/g, " ");
        if (now - spokenAt > SPEAK_EVERY_MS && spoken.dataset.gist !== gist) {
            spokenAt = now;
            spoken.dataset.gist = gist;
            setText(spoken, text);
        }
    }

    const keys = ["connection", "hello", "robot", "source", "gesture", "frame", "description", "jog"];
    store.watch(keys, () => {
        if (!timer) draw();
    });
    setInterval(draw, 500); // age changes without a message
}
