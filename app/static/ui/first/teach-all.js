// The step that teaches one gesture after another: shown as a drawing, taken when held still.

import { texts, told } from "../../texts/texts.js";
import { button, el, icon, isField, setText } from "../dom.js";
import { isDriving } from "../page.js";
import { describeError } from "../words.js";
import { boxOf, isStill } from "./advice.js";
import { Burst } from "./burst.js";
import { signWords } from "../seen.js";
import { Take } from "../take.js";
import { drawing, knownSign, signOf } from "./drawing.js";
import { Glass } from "./glass.js";
import { Round } from "./round.js";

const words = texts.first.teach;
const TICK_MS = 50;
const STALE_MS = 600;
const KEYS = { s: "skip", b: "back", r: "redo" };
const MARKS = { taught: "check", skipped: "close" };

/**
 * Contents of the step.
 * @param act {check, save, take}: see Burst
 * @param past {function(string)} called with the id of each gesture that is dealt with
 * @param done {function(Round)} called when none is left and all is saved
 */
export function teachStep({ store, video, progress, templateUrl, act, past, done }) {
    const round = new Round(store.state.gestures, progress);
    const burst = new Burst(act.take, act);
    const glass = new Glass(store, video);
    const model = el("div", { class: "first-model" });
    const name = el("p", { class: "first-name" });
    const sign = el("p", { class: "quiet" });
    const say = el("p", { class: "first-say", role: "status" });
    const note = el("p", { class: "first-note", role: "status" });
    const keep = button(words.keep, { id: "first-keep", hidden: true, onclick: () => keepWeak() });
    const able = {
        back: button(words.back, { id: "first-back", "aria-keyshortcuts": "B", onclick: () => wishes.back() }),
        redo: button(words.redo, { id: "first-redo", "aria-keyshortcuts": "R", onclick: () => wishes.redo() }),
        skip: button(words.skip, { id: "first-skip", "aria-keyshortcuts": "S", onclick: () => wishes.skip() }),
    };
    const tiles = el("ol", { class: "first-tiles", "aria-label": words.all });
    // Its room is kept, so that nothing moves when pictures come.
    const takes = el("ul", { class: "stills first-takes", "aria-label": words.takes });
    let shown = []; // Take[]
    let weak = null; // {gesture, pictures} that may be kept all the same
    let busy = false; // taken, and not judged yet
    let over = false;

    function draw() {
        const { current } = round;
        tiles.replaceChildren(...round.gestures.map(tile));
        able.back.disabled = !round.canGoBack;
        able.redo.disabled = !round.canRedo && !weak;
        keep.hidden = !weak;
        if (!current) return;
        model.replaceChildren(drawing(current, templateUrl));
        const number = round.gestures.indexOf(current) + 1;
        setText(name, words.title(current.name, number, round.gestures.length));
        setText(sign, signOf(current));
    }

    function tile(gesture) {
        const status = round.status.get(gesture.id);
        const now = gesture === round.current;
        return el(
            "li",
            { data: { status }, "aria-current": now ? "step" : null },
            el(
                "button",
                {
                    type: "button",
                    "aria-label": words.tile(gesture.name, words.statuses[now ? "now" : status]),
                    title: gesture.name,
                    onclick: () => move(() => round.goTo(gesture.id)),
                },
                MARKS[status] && !now ? icon(MARKS[status]) : el("span", { text: gesture.name[0] }),
            ),
        );
    }

    /** Show the pictures that were just judged; [] takes them away. */
    function show(taken) {
        for (const take of shown) take.close();
        shown = taken.map(({ picture, image }) => {
            const take = new Take(picture);
            take.judged(image);
            return take;
        });
        takes.replaceChildren(...shown.map(({ element }) => element));
    }

    /** Change the current gesture, and begin anew with it. */
    function move(change, told = "") {
        change();
        weak = null;
        busy = false;
        burst.next();
        setText(note, told);
        note.dataset.kind = "";
        draw();
        if (round.isOver) finish();
    }

    const wishes = {
        skip: () => {
            if (!round.current) return;
            past(round.current.id);
            move(() => round.settle("skipped"), words.skipped(round.current.name));
        },
        back: () => move(() => round.back()),
        redo: () => move(() => (weak ? null : round.redo())),
    };

    function keepWeak() {
        if (weak) settle(weak.gesture, weak.pictures, words.kept(weak.gesture.name));
    }

    function settle(gesture, pictures, told) {
        burst.save(gesture, pictures, (error) => {
            if (over) return;
            move(() => round.goTo(gesture.id), words.notSaved(gesture.name, describeError(error)));
            note.dataset.kind = "bad";
        });
        past(gesture.id);
        move(() => round.settle("taught"), told);
        note.dataset.kind = "good";
    }

    async function judge(gesture) {
        busy = true;
        let found;
        try {
            found = await burst.judge(gesture, knownSign(gesture.name));
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            found = { good: false, usable: false, code: "failed", reason: describeError(error), taken: [] };
        }
        if (!found || over) return; // somebody went elsewhere meanwhile
        busy = false;
        show(found.taken);
        if (found.good) {
            settle(gesture, found.pictures, words.taught(gesture.name, found.code === "near" ? found.other : null));
            return;
        }
        const problem = found.sign ? signWords(found.sign) : words.problems[found.code];
        const why = found.code === "like" ? words.like(found.other) : problem || told(found.reason) || words.problems.other;
        const more = found.code === "like" ? told(found.reason) : "";
        weak = found.usable ? { gesture, pictures: found.pictures } : null;
        burst.next();
        setText(note, words.weak(why, more));
        note.dataset.kind = "bad";
        draw();
    }

    async function finish() {
        await burst.saved;
        if (round.isOver && !over) {
            over = true;
            done(round);
        }
    }

    function warning() {
        const { robot } = store.state;
        if (!round.current || round.current.action.type !== "stop") return null;
        const other = robot && robot.controller && !isDriving(store.state) ? robot.controller : null;
        return other ? words.stopsOther(other) : words.stops;
    }

    function tick() {
        const now = performance.now();
        const { state } = store;
        const frame = now - state.frameAt < STALE_MS ? state.frame : null;
        const box = boxOf(frame, state.frameSize);
        if (busy || round.isOver) {
            say.dataset.phase = "busy";
            glass.draw(box, 1);
            setText(say, round.isOver ? words.saving : words.looking);
            return;
        }
        const { phase, share } = burst.update(now, { hand: Boolean(box), still: isStill(frame) });
        glass.draw(box, share);
        say.dataset.phase = phase;
        setText(say, warning() && phase !== "hold" ? warning() : words.phases[phase]);
        if (phase === "taken") judge(round.current);
    }

    function key(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || isField(event.target)) return;
        const wish = KEYS[event.key.toLowerCase()];
        if (!wish || able[wish].disabled) return;
        event.preventDefault();
        wishes[wish]();
    }

    draw();
    document.addEventListener("keydown", key);
    const timer = setInterval(tick, TICK_MS);
    if (round.isOver) finish();
    return {
        content: [
            el(
                "div",
                { class: "first-pair" },
                glass.element,
                el("div", { class: "first-wanted" }, name, model, sign),
            ),
            say,
            note,
            takes,
            tiles,
            el("div", { class: "row end" }, keep, able.back, able.redo, able.skip),
        ],
        focus: null,
        close() {
            over = true;
            show([]);
            clearInterval(timer);
            document.removeEventListener("keydown", key);
        },
    };
}
