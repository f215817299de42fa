// What the recognition makes of the hand, in one sentence: what it says, and why.

import { texts } from "../texts/texts.js";
import { showsHand } from "./page.js";

const words = texts.thought;
const STALE_MS = 700;

/** The two gestures that are nearest, by name; undefined where there are none. */
function nearest(state, now) {
    const fresh = state.detail && now - state.detailAt < STALE_MS;
    const distances = Object.entries((fresh && state.detail.distances) || {});
    distances.sort(([, a], [, b]) => a - b);
    const [first, second] = distances;
    return { first: first && first[0], distance: first && first[1], second: second && second[0] };
}

/** One sentence about the newest frame; the robot has no part in it. */
export function thoughtFor(state, now) {
    if (!showsHand(state)) return words.noSource;
    const { frame } = state;
    if (!frame) return words.waiting;
    if (now - state.frameAt > STALE_MS) return words.noFrames;
    const { first, distance, second } = nearest(state, now);
    if (frame.match) {
        const name = frame.match.gesture;
        // The distances may be a tenth of a second old, and of another gesture.
        const next = first === name ? second : undefined;
        if (frame.gesture === name) return next ? words.sureNext(name, next) : words.sure(name);
        return next ? words.settlingNext(name, next) : words.settling(name);
    }
    if (first !== undefined) {
        if (frame.cause === "moving") return words.movingNear(first);
        if (frame.cause === "low_margin" && second) return words.between(first, second);
        if (frame.cause === "unknown_hand") {
            return distance > state.detail.threshold ? words.tooFar(first) : words.unlike(first);
        }
    }
    return words.causes[frame.cause] || words.waiting;
}
