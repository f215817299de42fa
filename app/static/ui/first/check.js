// The step that looks whether the hand is seen well, and says what would be better.

import { texts } from "../../texts/texts.js";
import { button, el, icon, setIcon, setText } from "../dom.js";
import { allGood, boxOf, judge, LINES, measure } from "./advice.js";
import { drawing } from "./drawing.js";
import { Glass } from "./glass.js";
import { Steady } from "./hold.js";

const words = texts.first.check;
const TICK_MS = 66;
const MEASURE_MS = 200;
const GOOD_FOR_MS = 1200;
const STALE_MS = 600;
const SAY_EVERY_MS = 1500;
const [WIDTH, HEIGHT] = [64, 48];
const ICONS = { good: "check", fix: "mode-faulted", wait: "mode-unknown" };

/**
 * Contents of the step.
 * @param sign {?object} a gesture to show: one that stops nothing
 * @param left {boolean} whether the hand is a left one; `toLeft(left)` says so
 * @param go {function()} goes on
 */
export function checkStep({ store, video, sign, templateUrl, left, toLeft, go }) {
    const glass = new Glass(store, video, sign ? drawing(sign, templateUrl) : null);
    const rows = Object.fromEntries(
        LINES.map((what) => {
            const mark = icon("mode-unknown");
            const told = el("span", { class: "hidden" });
            const advice = el("p", {});
            const row = el(
                "li",
                { data: { what, sign: "wait" } },
                mark,
                el("div", {}, el("strong", { text: words.lines[what] }), told, advice),
            );
            return [what, { row, mark, told, advice }];
        }),
    );
    const say = el("p", { class: "first-say", role: "status" });
    const bar = el("span", { class: "first-fill" });
    const on = button(words.go, { id: "first-go", onclick: () => go() });
    const hand = button(words.left, {
        id: "first-left",
        "aria-pressed": String(left),
        onclick: () => {
            const pressed = hand.getAttribute("aria-pressed") !== "true";
            hand.setAttribute("aria-pressed", String(pressed));
            toLeft(pressed);
        },
    });
    const steady = new Steady(GOOD_FOR_MS);
    const small = document.createElement("canvas");
    small.width = WIDTH;
    small.height = HEIGHT;
    let measured = null;
    let measuredAt = -Infinity;
    let saidAt = -Infinity;

    function look(now, box) {
        if (now - measuredAt < MEASURE_MS || !video.videoWidth) return;
        measuredAt = now;
        const context = small.getContext("2d", { willReadFrequently: true });
        context.drawImage(video, 0, 0, WIDTH, HEIGHT);
        measured = measure(context.getImageData(0, 0, WIDTH, HEIGHT).data, WIDTH, HEIGHT, box);
    }

    function show(lines, now) {
        for (const { what, code, sign: is } of lines) {
            const { row, mark, told, advice } = rows[what];
            row.dataset.code = code;
            row.dataset.sign = is;
            setIcon(mark, ICONS[is]);
            setText(told, `: ${words.signs[is]}`);
            setText(advice, words.advice[what][code]);
        }
        const first = lines.find(({ sign: is }) => is === "fix") || lines.find(({ sign: is }) => is === "wait");
        const text = first ? words.advice[first.what][first.code] : words.good;
        if (text !== say.textContent && now - saidAt > SAY_EVERY_MS) {
            saidAt = now;
            setText(say, text);
        }
    }

    function tick() {
        const now = performance.now();
        const { state } = store;
        const frame = now - state.frameAt < STALE_MS ? state.frame : null;
        const box = boxOf(frame, state.frameSize);
        look(now, box);
        const lines = judge(measured, frame, state.frameSize);
        const share = steady.update(now, allGood(lines));
        show(lines, now);
        glass.draw(box, share);
        bar.style.transform = `scaleX(${share.toFixed(3)})`;
        if (share >= 1) go();
    }

    const timer = setInterval(tick, TICK_MS);
    tick();
    return {
        content: [
            el("p", { text: sign ? words.intro : words.introPlain }),
            el("div", { class: "first-pair" }, glass.element, el("ul", { class: "first-lines" }, ...Object.values(rows).map(({ row }) => row))),
            el("div", { class: "first-bar", "aria-hidden": "true" }, bar),
            say,
            el("div", { class: "row end" }, hand, on),
        ],
        focus: null, // on a phone the button is below the picture
        close: () => clearInterval(timer),
    };
}
