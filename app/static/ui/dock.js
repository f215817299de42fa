// The controls that are always in reach: steps, take control, arm, reset, STOP.

import { texts } from "../texts/texts.js";
import { button, el, icon, part, setHidden, setLabel, setText, want } from "./dom.js";
import { isDriving, modeOf } from "./page.js";

/** Which of the three steps to driving are done, and which is next. */
export function progress(state) {
    const done = {
        source: state.source.state === "running",
        control: isDriving(state),
        armed: Boolean(isDriving(state) && state.robot.armed),
    };
    const next = Object.keys(done).find((step) => !done[step]) || null;
    return { done, next };
}

export function steps(element, store) {
    const items = Object.entries(texts.steps).map(([step, label], index) => {
        const mark = el("span", { class: "step-mark", text: String(index + 1) }, icon("check"));
        const item = el("li", { data: { step } }, mark, el("span", { text: label }));
        element.append(item);
        return item;
    });
    store.watch(["connection", "hello", "robot", "source"], (state) => {
        const { done, next } = progress(state);
        for (const item of items) {
            const { step } = item.dataset;
            item.classList.toggle("is-done", done[step]);
            if (step === next) item.setAttribute("aria-current", "step");
            else item.removeAttribute("aria-current");
        }
    });
}

export function dockButtons(element, store) {
    const ask = (what) => () => want(element, what);
    const start = button(texts.actions.start, { id: "btn-start", onclick: ask("start") });
    const control = button(texts.actions.take, {
        id: "btn-control",
        "aria-keyshortcuts": "C",
        onclick: ask("toggle-control"),
    });
    const arm = button(texts.actions.arm, {
        id: "btn-arm",
        "aria-keyshortcuts": "A",
        onclick: ask("toggle-arm"),
    });
    const reset = button(texts.actions.reset, { id: "btn-reset", onclick: ask("reset") });
    element.append(start, control, arm, reset);

    store.watch(["connection", "hello", "robot", "source"], (state) => {
        const connected = state.connection.state === "open" && Boolean(state.robot);
        const mode = modeOf(state);
        const driving = isDriving(state);
        const other = connected && state.robot.controller && !driving;
        const stopped = mode === "stopped";
        const { next } = progress(state);

        setHidden(start, next !== "source" || stopped);
        start.disabled = state.source.state === "starting";
        setHidden(reset, !stopped);
        setHidden(arm, stopped);
        control.disabled = !connected;
        arm.disabled = !driving || !["disarmed", "armed", "moving", "holding"].includes(mode);
        setLabel(
            control,
            driving ? texts.actions.release : other ? texts.actions.takeOver : texts.actions.take,
        );
        const armed = driving && state.robot.armed;
        // A robot that holds can be armed again by its operator, which ends the holding.
        setLabel(arm, armed ? texts.actions.disarm : texts.actions.arm);
        start.classList.toggle("primary", !start.hidden);
        control.classList.toggle("primary", next === "control" && !stopped && !other);
        arm.classList.toggle("primary", next === "armed" && !stopped);
        reset.classList.add("primary");
        element.dataset.next = stopped ? "reset" : next || "drive";
    });
}

/**
 * The stop button: acts on pointer down, not on release, and never goes grey. A click without a
 * pointer (Enter, a screen reader) counts too.
 */
export function stopButton(element, store) {
    const hint = part(element, "hint");
    setText(part(element, "word"), texts.stop);
    element.setAttribute("aria-label", texts.stopLabel);
    let pressedAt = -Infinity;
    element.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        pressedAt = performance.now();
        want(element, "stop");
    });
    element.addEventListener("click", () => {
        if (performance.now() - pressedAt > 1000) want(element, "stop");
        pressedAt = -Infinity;
    });
    store.watch(["stopping", "robot", "connection"], (state) => {
        const stopped = modeOf(state) === "stopped";
        const shown = stopped && state.stopping !== "sending" ? "stopped" : state.stopping;
        element.dataset.state = shown;
        setText(hint, texts.stopStates[shown] || texts.stopHint);
    });
}
