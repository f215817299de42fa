// What tests in a browser, and the curious, may read of the page.

/**
 * Reads only. `robot`, `frame`, `gesture`, `hello` are the newest messages, `counts` how many of each
 * type came, `frames` what became of the webcam's pictures, `pictures` how many each robot camera has
 * shown, `shown` what the newest of them is ({tick, takenAt, shownAt}), `latency` where a frame's time
 * goes, `error` the newest `error` message.
 */
export function inspection({ store, sender, feeds, counts, error, shown, reading }) {
    return Object.freeze({
        get state() {
            return { ...store.state };
        },
        get hello() {
            return store.state.hello;
        },
        get robot() {
            return store.state.robot;
        },
        get frame() {
            return store.state.frame;
        },
        get gesture() {
            return store.state.gesture;
        },
        get error() {
            return error();
        },
        get counts() {
            return { ...counts };
        },
        get frames() {
            const { counts: became, latencyMs, rate, level, width, height } = sender;
            return { ...became, latencyMs, rate, level, width, height };
        },
        get pictures() {
            return { wrist: feeds.wrist.pictures, scene: feeds.scene.pictures };
        },
        get shown() {
            return { ...shown() };
        },
        get latency() {
            return reading();
        },
    });
}
