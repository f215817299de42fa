// What each message of the server changes in the store.

/** The state that the page starts with. Times are on performance.now(). */
export const INITIAL_STATE = Object.freeze({
    connection: { state: "connecting", retryAt: 0 },
    hello: null, // the session's `hello`; kept while the connection is away
    robot: null, // newest `robot` message of this connection
    description: null, // of the robot: joints and limits, poses
    wasArmed: false, // whether this session was armed since it took control
    frame: null, // newest `frame` message
    frameAt: -Infinity,
    frameSize: { width: 0, height: 0 }, // of the frame it is about, pixels
    detail: null, // newest masks, template and distances
    detailFrame: null, // the frame that it is of
    detailAt: -Infinity,
    gesture: null, // newest `gesture` message
    jog: null, // newest `jog` message: why nothing comes of what is held
    timeline: null, // newest `timeline` message: something happened
    people: null, // newest `people` message
    gallery: "shared", // id of the gallery that this page is recognised against
    galleries: null, // those there are; null until known, and where there is only the shared one
    gestures: [], // of that gallery
    gesturesState: "loading",
    galleryVersion: 0,
    source: { state: "none" },
    cameras: [],
    sender: { rate: 0, latencyMs: null, width: 0, height: 0 },
    clipGesture: undefined, // gesture that the synthetic operator shows; undefined: not known
    stopping: "idle",
    first: null, // how far the first minutes with that gallery have come
    speed: 1, // part of the ordinary speed
    fine: false,
    glass: false, // whether the glass box is open
});

/** Changes of the store for `message`; null for messages that change nothing in it. */
export function changesFor(message, state, now) {
    switch (message.type) {
        case "hello":
            return { hello: message, robot: null, frame: null, detail: null, gesture: null, jog: null };
        case "frame": {
            const changes = { frame: message, frameAt: now };
            if (message.detail) {
                Object.assign(changes, { detail: message.detail, detailFrame: message, detailAt: now });
            }
            return changes;
        }
        case "gesture":
            return { gesture: message };
        case "jog":
            return { jog: message };
        case "timeline":
            return { timeline: message };
        case "people":
            return { people: message };
        case "robot": {
            const mine = state.hello && message.controller === state.hello.session;
            const wasArmed = Boolean(mine && (state.wasArmed || message.armed));
            return { robot: message, wasArmed };
        }
        default:
            return null;
    }
}
