// The open glass box: every step of the recognition, drawn as it happens. Loaded when first opened.

import { texts, told } from "../../texts/texts.js";
import { bitmapFromBase64, el, setText } from "../dom.js";
import { number, percent, short } from "../words.js";
import { colours } from "./canvas.js";
import { nearestList, room } from "./nearest.js";
import { drawMask, drawMotion, drawRegion, drawTemplate, drawWrist } from "./pictures.js";
import { drawProjection } from "./projection.js";

const words = texts.glass;
const STALE_MS = 700;

/** One step: a picture, its name and a figure; in words for readers. */
function step(name, { mirrored = true } = {}) {
    const canvas = el("canvas", {
        class: mirrored ? "mirrored" : null,
        role: "img",
        "aria-label": words[name],
    });
    const value = el("span", { class: "step-value" });
    const caption = el("figcaption", {}, el("span", { class: "step-name", text: words[name] }), value);
    const element = el("li", { data: { stage: name } }, el("figure", {}, canvas, caption));
    return {
        canvas,
        element,
        /** `text` is null when the frame did not get that far. */
        tell(text, alternative) {
            element.dataset.reached = text === null ? "no" : "yes";
            setText(value, text === null ? words.unreached : text);
            const label = text === null ? `${words[name]}: ${words.unreached}` : alternative;
            if (canvas.getAttribute("aria-label") !== label) canvas.setAttribute("aria-label", label);
        },
    };
}

function legend() {
    const entry = (kind) =>
        el(
            "span",
            { class: "legend-entry" },
            el("span", { class: "legend-mark", data: { kind }, "aria-hidden": "true" }),
            el("span", { text: words.legend[kind] }),
        );
    return el("p", { class: "legend" }, entry("first"), entry("second"), entry("you"));
}

/** Fills `element`, and draws into it whenever the server has told more. */
export function glassBox(element, store, { templateUrl }) {
    const steps = Object.fromEntries(
        ["mask", "motion", "wrist", "region", "template"].map((name) => [name, step(name)]),
    );
    steps.projection = step("projection", { mirrored: false });
    steps.projection.element.append(legend());
    const near = nearestList(store, templateUrl);
    const left = room();
    const fact = (id, label) => {
        const value = el("dd", { id, text: words.nothing });
        facts.append(el("div", {}, el("dt", { text: label }), value));
        return value;
    };
    const facts = el("dl", { class: "glass-facts" });
    const why = fact("seen-why", words.why);
    const mode = fact("seen-mask", words.mode);
    const rate = fact("seen-rate", words.rate);
    element.append(
        el(
            "ol",
            { class: "glass-steps", "aria-label": words.steps },
            ...Object.values(steps).map((each) => each.element),
        ),
        el("h3", { text: words.nearest }),
        near.element,
        el("h3", { text: words.room }),
        left.element,
        facts,
    );

    function tellSteps({ frame, detail, glass, size }) {
        const { motion, still, roi } = frame;
        // The histogram's mean is the mask's share of hand.
        const shares = glass.histogram && glass.histogram.shares;
        const share = shares && percent(shares.reduce((sum, each) => sum + each, 0) / shares.length);
        steps.mask.tell(share ? words.maskValue(share) : words.maskNone, words.maskAlt(share));
        const limit = percent(glass.motion_limit, short);
        const moved = glass.mismatch === null || motion === null ? null : percent(motion);
        steps.motion.tell(
            moved && words.motionValue(moved, limit),
            words.motionAlt(moved, limit, still),
        );
        const side = detail.wrist && words.wristValue[detail.wrist.side];
        steps.wrist.tell(
            glass.palm && (side || words.wristNone),
            `${words.wristAlt[glass.wrist_mode]} (${side || words.wristNone})`,
        );
        const [, , width, height] = roi || size;
        steps.region.tell(roi && words.regionValue(width, height), words.regionAlt(width, height));
        steps.template.tell(detail.template && words.templateValue, words.templateAlt);
        const { share: axes, query } = glass.projection;
        const both = number((axes[0] + axes[1]) * 100, 0);
        const first = glass.answer && glass.answer.gesture;
        steps.projection.tell(
            query && words.projectionValue(texts.numbers.percent(both)),
            words.projectionAlt(first),
        );
    }

    function drawSteps({ frame, detail, glass, bitmaps, size }) {
        const paint = colours();
        const scene = { ...bitmaps, ...glass, mismatch: bitmaps.mismatch, wrist: detail.wrist, roi: frame.roi };
        const inFrame = { width: size[2], height: size[3] };
        drawMask(steps.mask.canvas, scene);
        drawMotion(steps.motion.canvas, scene, paint);
        drawWrist(steps.wrist.canvas, scene, inFrame, paint);
        drawRegion(steps.region.canvas, scene, inFrame, paint);
        drawTemplate(steps.template.canvas, scene);
        const { gesture = null, second = null } = glass.answer || {};
        drawProjection(steps.projection.canvas, glass.projection, gesture, second, paint);
    }

    let busy = false;
    let last = null;
    async function show(state) {
        const { detail, detailFrame: frame } = state;
        if (busy || !state.glass || !frame || !detail || !detail.glass || detail === last) return;
        last = detail;
        busy = true;
        const { glass } = detail;
        const decode = (png) => (png ? bitmapFromBase64(png) : null);
        const [mask, mismatch, template] = await Promise.all(
            [detail.mask, glass.mismatch, detail.template].map(decode),
        );
        const bitmaps = { mask, mismatch, template };
        const size = [0, 0, state.sender.width || 640, state.sender.height || 480];
        const all = { frame, detail, glass, bitmaps, size };
        drawSteps(all);
        tellSteps(all);
        near.draw(glass.nearest);
        left.draw(glass.answer, detail.threshold);
        const { mode: way, why: because } = frame.mask;
        setText(mode, words.modeValue(words.modes[way] || way, told(because)));
        setText(why, told(frame.reason) || words.nothing);
        for (const bitmap of Object.values(bitmaps)) if (bitmap) bitmap.close();
        busy = false;
    }
    store.watch(["detail", "glass"], show);
    store.watch(["sender"], ({ sender }) => setText(rate, words.rateValue(sender.rate)));
    setInterval(() => {
        const stale = performance.now() - store.state.detailAt > STALE_MS;
        element.classList.toggle("is-stale", stale);
    }, 300);
}
