// The templates that lie nearest to the hand, and the room that is left before it is refused.

import { texts } from "../../texts/texts.js";
import { el, setText } from "../dom.js";
import { number } from "../words.js";

const words = texts.glass;
const SHOWN = 5;

/** A list of pictures; a picture is changed only when another template takes its place. */
export function nearestList(store, templateUrl) {
    const none = el("p", { class: "quiet", text: words.noneNear });
    const list = el("ol", { class: "near-list", "aria-label": words.nearest });
    const places = Array.from({ length: SHOWN }, () => {
        const picture = el("img", { class: "thumb", width: 36, height: 48, alt: "" });
        const name = el("span", { class: "near-name" });
        const distance = el("span", { class: "near-distance" });
        const item = el("li", { hidden: true }, picture, name, distance);
        list.append(item);
        return { item, picture, name, distance };
    });

    function draw(nearest) {
        none.hidden = nearest.length > 0;
        const known = new Map(store.state.gestures.map((gesture) => [gesture.id, gesture]));
        places.forEach(({ item, picture, name, distance }, index) => {
            const found = nearest[index];
            item.hidden = !found;
            if (!found) return;
            const gesture = known.get(found.id);
            const version = String((gesture && gesture.updated) || store.state.galleryVersion);
            const url = found.id ? templateUrl(found.id, version, found.sample) : "";
            if (url && picture.getAttribute("src") !== url) picture.setAttribute("src", url);
            setText(name, found.gesture);
            setText(distance, number(found.distance, 2));
            picture.alt = words.nearestItem(found.gesture, number(found.distance, 2));
        });
    }
    return { element: el("div", { class: "near" }, none, list), draw };
}

/**
 * What each test allows, as a bar from nothing to twice the limit: inside of the limit it passes.
 * Told by a word, too.
 */
function test(label) {
    const fill = el("span", { class: "room-fill" });
    const verdict = el("span", { class: "room-verdict" });
    const value = el("span", { class: "room-value" });
    const element = el(
        "div",
        { class: "room-row" },
        el("dt", { text: label }),
        el(
            "dd",
            {},
            el("span", { class: "room-bar", "aria-hidden": "true" }, fill, el("span", { class: "room-mark" })),
            value,
            verdict,
        ),
    );
    return {
        element,
        set(text, share, passes) {
            element.classList.toggle("is-refused", passes === false);
            fill.style.inlineSize = `${(50 * Math.min(2, Math.max(0, share))).toFixed(1)}%`;
            setText(value, text);
            setText(verdict, passes === null ? "" : passes ? words.passes : words.refused);
        },
    };
}

export function room() {
    const distance = test(words.distance);
    const lead = test(words.lead);
    const outline = test(words.outline);
    const element = el("dl", { class: "room" }, distance.element, lead.element, outline.element);

    function draw(answer, threshold) {
        if (!answer) {
            for (const each of [distance, lead, outline]) each.set(words.nothing, 0, null);
            return;
        }
        const two = (value) => number(value, 2);
        distance.set(
            words.atMost(two(answer.distance), two(threshold)),
            answer.distance / threshold,
            answer.distance <= threshold,
        );
        outline.set(
            words.atMost(two(answer.error), two(answer.max_error)),
            answer.error / answer.max_error,
            answer.error <= answer.max_error,
        );
        if (answer.margin === null) lead.set(words.nothing, 0, null);
        else {
            lead.set(
                words.atLeast(two(answer.margin), two(answer.min_margin)),
                answer.margin / Math.max(answer.min_margin, 1e-6),
                answer.margin >= answer.min_margin,
            );
        }
    }
    return { element, draw };
}
