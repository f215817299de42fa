// The first minutes: choose a picture, check it, teach the gestures, drive once. One sheet, step by step.

import { texts } from "../../texts/texts.js";
import { button, el, loadStyles } from "../dom.js";
import { sourceChoices, sourceProblem } from "../operator-view.js";
import { isDriving } from "../page.js";
import { checkStep } from "./check.js";
import { driveStep } from "./drive.js";
import { active, FRESH, stepNow, STEPS } from "./plan.js";
import { teachStep } from "./teach-all.js";
import { whoseContent } from "./whose.js";

const words = texts.first;
const WATCH_MS = 150;
const DISARM_EVERY_MS = 1000;
const STYLES = "static/styles/first.css";

/**
 * @param host element that wishes are told from
 * @param sheets where it is shown
 * @param progress {get(), set(progress)} what is remembered of the gallery in use
 * @param act {check, save, take, disarm, choose, create, isChosen, drive}: see the steps; `drive()` goes
 *   on to driving without them
 */
export class FirstMinutes {
    #disarmedAt = -Infinity;
    #note = ""; // what came of the teaching
    #waits = 0; // for the gestures

    constructor({ host, store, video, sheets, progress, act, templateUrl, told }) {
        Object.assign(this, { host, store, video, sheets, progress, act, templateUrl, told });
    }

    /** Go on where somebody stands. */
    async open() {
        this.#note = "";
        await loadStyles(STYLES);
        this.#next();
    }

    /** All over again: the check, the teaching of each gesture, the drive. */
    again() {
        const { left } = this.progress.get();
        this.progress.set({ ...FRESH, left, again: true });
        return this.open();
    }

    #now() {
        return stepNow(this.store.state, this.progress.get(), this.act.isChosen());
    }

    #learn(changes) {
        this.progress.set({ ...this.progress.get(), ...changes });
    }

    /** Each step is about the gestures of who was chosen: none begins before these are here. */
    #next() {
        clearTimeout(this.#waits);
        if (this.store.state.gesturesState === "loading") {
            this.#waits = setTimeout(() => this.#next(), WATCH_MS);
            return;
        }
        this.#show(this.#now());
    }

    #show(step) {
        if (step === "done") {
            this.sheets.close();
            return;
        }
        this.#learn({ begun: true });
        const { content, focus, close } = this.#content(step);
        const watch = setInterval(() => this.#watch(step), WATCH_MS);
        const sheet = this.sheets.show("first", words.titles[step], [this.#steps(step), ...content], {
            focus,
            onclose: () => {
                clearInterval(watch);
                clearTimeout(this.#waits);
                close();
            },
        });
        sheet.dataset.step = step;
        sheet.classList.toggle("is-left", this.progress.get().left);
    }

    /** A picture that is turned off, or the drawn hand instead, leads elsewhere. */
    #watch(step) {
        const { state } = this.store;
        const running = state.source.state === "running";
        const other = !running || state.source.kind !== "camera";
        if (step === "source" ? running : step !== "drive" && other) {
            this.#next();
            return;
        }
        // What is shown to be checked or taught is not to move the arm.
        const armed = isDriving(state) && state.robot.armed;
        const shows = step === "check" || step === "teach";
        if (shows && armed && performance.now() - this.#disarmedAt > DISARM_EVERY_MS) {
            this.#disarmedAt = performance.now();
            this.act.disarm();
            this.told(words.disarmed);
        }
    }

    #steps(step) {
        const shown = STEPS.filter((one) => one !== "whose" || this.store.state.galleries);
        return el(
            "ol",
            { class: "first-steps", "aria-label": words.steps },
            ...shown.map((one) =>
                el("li", {
                    class: STEPS.indexOf(one) < STEPS.indexOf(step) ? "is-done" : "",
                    "aria-current": one === step ? "step" : null,
                    text: words.stepNames[one],
                }),
            ),
        );
    }

    #content(step) {
        const { store, video, templateUrl, act } = this;
        switch (step) {
            case "source":
                return this.#source();
            case "whose":
                return whoseContent({ store, act, done: () => this.#next() });
            case "check": {
                const sign = active(store.state.gestures).find(({ action }) => action.type !== "stop");
                return checkStep({
                    store,
                    video,
                    sign,
                    templateUrl,
                    left: this.progress.get().left,
                    toLeft: (left) => {
                        this.#learn({ left });
                        document.getElementById("sheet-first").classList.toggle("is-left", left);
                    },
                    go: () => {
                        this.#learn({ checked: true });
                        this.#next();
                    },
                });
            }
            case "teach":
                return teachStep({
                    store,
                    video,
                    templateUrl,
                    act,
                    progress: this.progress.get(),
                    past: (id) => {
                        const { past } = this.progress.get();
                        if (!past.includes(id)) this.#learn({ past: [...past, id] });
                    },
                    done: (round) => {
                        this.#note = words.teach.over(round.count("taught"), round.count("skipped"));
                        this.#next();
                    },
                });
            default:
                return driveStep({
                    store,
                    templateUrl,
                    note: this.#note,
                    progress: () => this.progress.get(),
                    keep: (progress) => this.progress.set(progress),
                    done: () => {
                        this.#learn({ done: true, again: false });
                        this.sheets.close();
                    },
                });
        }
    }

    #source() {
        const box = el("div", { class: "choices-row" });
        let drawn = "";
        const draw = () => {
            const { state, error } = this.store.state.source;
            const look = `${state} ${error}`;
            if (look === drawn) return;
            drawn = look;
            if (state === "starting") box.replaceChildren(el("p", { role: "status", text: texts.operator.asking }));
            else if (state === "error") box.replaceChildren(...sourceProblem(this.host, error));
            else box.replaceChildren(...sourceChoices(this.host, "first"));
        };
        draw();
        const timer = setInterval(draw, WATCH_MS);
        const known = button(words.known, {
            id: "first-known",
            class: "quiet-button",
            onclick: () => {
                this.#learn({ done: true });
                this.act.drive();
            },
        });
        return {
            content: [el("p", { text: words.welcome }), box, el("div", { class: "row end" }, known)],
            focus: box.querySelector("button"),
            close: () => clearInterval(timer),
        };
    }
}
