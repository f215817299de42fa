// The guided drive: what to do next, beside the cockpit. It presses nothing by itself.

import { texts } from "../../texts/texts.js";
import { button, el, icon, setText } from "../dom.js";
import { isDriving } from "../page.js";
import { drawing, signOf } from "./drawing.js";
import { Steady } from "./hold.js";
import { driveTask, learn, movedBy, suggested } from "./plan.js";

const words = texts.first.drive;
const TICK_MS = 100;
const SEEN_MS = 450; // a shorter motion is not noticed
const LIST = ["control", "arm", "show", "stop", "reset"];
const POINTS_AT = { reset: "btn-reset", ask: "btn-control", control: "btn-control", arm: "btn-arm", stop: "stop" };

/** Which of LIST are done. */
function doneOf(task, state, progress) {
    const drives = isDriving(state);
    const shown = progress.moved.length > 1;
    return {
        control: drives || shown,
        arm: (drives && state.robot.armed) || shown,
        show: shown,
        stop: progress.stopped,
        reset: progress.stopped && task === "done",
    };
}

/**
 * Contents of the step.
 * @param note {string} what came of the step before, or ""
 * @param progress {function(): object} what was learnt so far; `keep(progress)` remembers more
 * @param done {function()} called by the last button
 */
export function driveStep({ store, templateUrl, note, progress, keep, done }) {
    const say = el("p", { class: "first-say", role: "status" });
    const why = el("p", { class: "quiet" });
    const model = el("div", { class: "first-model" });
    const items = LIST.map((task) =>
        el("li", { data: { task } }, el("span", { class: "step-mark" }, icon("check")), el("span", { text: words.list[task] })),
    );
    const last = button(words.finish, { id: "first-finish", class: "primary", hidden: true, onclick: () => done() });
    const moving = new Steady(SEEN_MS);
    let mover = null;
    let pictured = null;
    let pointed = null;

    function point(id) {
        if (pointed === id) return;
        if (pointed) document.getElementById(pointed).classList.remove("is-pointed");
        if (id) document.getElementById(id).classList.add("is-pointed");
        pointed = id;
    }

    function picture(gesture) {
        const key = gesture && gesture.id;
        if (key === pictured) return;
        pictured = key;
        model.replaceChildren(...(gesture ? [drawing(gesture, templateUrl), el("p", { class: "quiet", text: signOf(gesture) })] : []));
    }

    /** The gesture that moved the arm long enough to be seen. */
    function seen(name) {
        // The drawn hand shows each gesture for a second only.
        if (store.state.source.kind === "synthetic") return name;
        if (name && name !== mover) {
            mover = name;
            moving.reset();
        }
        return moving.update(performance.now(), name !== null) >= 1 ? mover : null;
    }

    function tick() {
        const { state } = store;
        const drives = isDriving(state);
        const before = progress();
        const after = learn(state, seen(movedBy(state, drives)), before);
        if (after !== before) keep(after);
        const task = driveTask(state.robot, drives, after);
        const synthetic = state.source.kind === "synthetic";
        const wanted = task === "show" ? suggested(state.gestures, after.moved) : null;
        const told = wanted
            ? synthetic ? words.watch : words.show(wanted.name, after.moved.length)
            : words.tasks[task](state.robot && state.robot.controller);
        setText(say, told);
        setText(why, task === "show" ? words.showWhy : words.why[task] || "");
        picture(synthetic ? null : wanted);
        point(POINTS_AT[task] || null);
        const all = doneOf(task, state, after);
        items.forEach((item) => {
            const { task: one } = item.dataset;
            item.classList.toggle("is-done", all[one]);
            if (one === task) item.setAttribute("aria-current", "step");
            else item.removeAttribute("aria-current");
        });
        const finished = task === "done";
        if (finished && last.hidden) {
            last.hidden = false;
            last.focus();
        }
        last.hidden = !finished;
    }

    const timer = setInterval(tick, TICK_MS);
    tick();
    return {
        content: [
            note ? el("p", { class: "first-note", data: { kind: "good" }, text: note }) : null,
            el("ol", { class: "first-tasks" }, ...items),
            say,
            why,
            model,
            el("div", { class: "row end" }, last),
        ].filter(Boolean),
        focus: null,
        close() {
            clearInterval(timer);
            point(null);
        },
    };
}
