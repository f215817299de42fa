// After teaching: show the gesture, and see at once whether it is known.

import { texts, told } from "../texts/texts.js";
import { button, el, icon, setText } from "./dom.js";
import { Steady } from "./first/hold.js";
import { isDriving } from "./page.js";

const words = texts.tryNow;
const TICK_MS = 66;
const STALE_MS = 600;
const HELD_MS = 1000;

/** What the newest frame says of `name`: {kind, text}; `kind` is "none", "other" or "match". */
export function liveMatch(frame, name) {
    if (!frame) return { kind: "none", text: words.noPicture };
    const seen = frame.match && frame.match.gesture;
    if (!seen) return { kind: "none", text: told(frame.reason) || words.nothing };
    return seen === name ? { kind: "match", text: words.match(name) } : { kind: "other", text: words.other(seen) };
}

/**
 * Contents of a sheet. `gesture` is {name, action}; `addPhoto` opens the sheet that takes more pictures,
 * `done` closes this one.
 */
export function tryContent({ gesture, store, video, addPhoto, done }) {
    const { name, action } = gesture;
    const steady = new Steady(HELD_MS);
    const picture = el("canvas", { class: "capture-preview", "aria-hidden": "true", width: 320, height: 240 });
    const live = el("p", { class: "try-live" });
    const mark = icon("check");
    const verdict = el("p", { class: "try-verdict", role: "status" });
    const add = button(words.add, { id: "try-add", iconName: "camera", onclick: addPhoto });
    const close = button(words.done, { id: "try-done", class: "primary", onclick: done });
    const line = el("div", { class: "try-line", data: { held: "false" } }, mark, verdict);
    const warning = el("p", { class: "quiet" });
    setText(verdict, words.show(name));

    function draw(state) {
        if (state.source.state !== "running" || !video.videoWidth) return;
        // Who drives looks at the robot: nothing moves here meanwhile.
        if (isDriving(state) && state.robot.armed) return;
        const { videoWidth: width, videoHeight: height } = video;
        const tall = Math.round((320 * height) / width);
        if (picture.height !== tall) picture.height = tall;
        picture.getContext("2d").drawImage(video, 0, 0, 320, tall);
    }

    function warn(state) {
        if (isDriving(state) && state.robot.armed) return words.moves;
        return action && action.type === "stop" ? words.stops : "";
    }

    function tick() {
        const now = performance.now();
        const { state } = store;
        const { kind, text } = liveMatch(now - state.frameAt < STALE_MS ? state.frame : null, name);
        live.dataset.kind = kind;
        setText(live, text);
        setText(warning, warn(state));
        if (steady.update(now, kind === "match") >= 1 && line.dataset.held === "false") {
            line.dataset.held = "true";
            setText(verdict, words.held(name));
        }
        draw(state);
    }

    const timer = setInterval(tick, TICK_MS);
    tick();
    return {
        content: [
            el("div", { class: "capture-frame" }, picture, live),
            line,
            warning,
            el("p", { class: "quiet", text: words.hint }),
            el("div", { class: "row end" }, add, close),
        ],
        focus: close,
        close: () => clearInterval(timer),
    };
}
