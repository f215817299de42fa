// The enrolled gestures, what each does, and how close the hand is to each right now.

import { texts } from "../texts/texts.js";
import { button, el, icon, part, setHidden, setText, want } from "./dom.js";
import { describeAction, number } from "./words.js";

const words = texts.gestures;
const STALE_MS = 600;
const REDRAW_MS = 90;

function row(gesture, state, element, templateUrl) {
    const picture = el("img", {
        class: "thumb",
        src: templateUrl(gesture.id, String(gesture.updated || state.galleryVersion)),
        alt: "",
        width: 30,
        height: 40,
        loading: "lazy",
    });
    const distance = el("span", { class: "distance", text: words.noDistance });
    const fill = el("span", { class: "bar-fill" });
    const mark = el("span", { class: "bar-mark" });
    const item = el(
        "li",
        { class: "gesture", data: { gesture: gesture.name, id: gesture.id } },
        picture,
        el(
            "div",
            { class: "gesture-body" },
            el(
                "p",
                { class: "gesture-line" },
                el("span", { class: "gesture-name", text: gesture.name }),
                el("span", {
                    class: "gesture-action",
                    text: gesture.active === false ? words.retired : describeAction(gesture.action, state.description),
                }),
            ),
            el("div", { class: "gesture-meter" }, el("span", { class: "bar" }, fill, mark), distance),
        ),
        el("span", { class: "match-mark" }, icon("check"), el("span", { class: "hidden", text: words.match })),
        button("", {
            class: "round small quiet-button",
            iconName: "edit",
            "aria-label": words.edit(gesture.name),
            onclick: () => want(element, "edit-gesture", { id: gesture.id }),
        }),
    );
    return { item, distance, fill, mark, name: gesture.name };
}

/**
 * Bars show closeness, so that longer is better: full at distance 0, empty at twice the distance
 * that is still accepted. The mark stands where a gesture begins to count.
 */
function barScale(detail) {
    const threshold = Number(detail && detail.threshold);
    if (threshold > 0) return { end: threshold * 2, mark: 0.5 };
    const all = Object.values((detail && detail.distances) || {}).filter(Number.isFinite);
    return { end: Math.max(...all, 1e-6) * 1.1, mark: null };
}

export function gestureList(element, store, { templateUrl }) {
    const list = part(element, "list");
    const note = part(element, "note");
    let rows = [];

    store.watch(["gestures", "gesturesState", "description"], (state) => {
        const { gestures, gesturesState } = state;
        const text =
            gesturesState === "failed" ? words.failed
            : gesturesState === "loading" ? words.loading
            : gestures.length ? words.legend
            : words.empty;
        setText(note, text);
        // Who stands on a gesture's button stays there: the list is told anew after every change.
        const stood = list.contains(document.activeElement)
            ? document.activeElement.closest("[data-id]").dataset.id
            : null;
        rows = gestures.map((gesture) => row(gesture, state, element, templateUrl));
        list.replaceChildren(...rows.map(({ item }) => item));
        const there = rows.find(({ item }) => item.dataset.id === stood);
        if (there) there.item.querySelector("button").focus({ preventScroll: true });
        draw();
    });

    function draw() {
        const state = store.state;
        const now = performance.now();
        const running = state.source.state === "running";
        const fresh = running && state.detail && now - state.detailAt < STALE_MS;
        const distances = (fresh && state.detail.distances) || {};
        const scale = barScale(fresh ? state.detail : null);
        const held =
            running && state.gesture && state.gesture.phase !== "end" ? state.gesture.gesture : null;
        const matchName =
            running && state.frame && state.frame.match && now - state.frameAt < STALE_MS
                ? state.frame.match.gesture
                : null;
        for (const { item, distance, fill, mark, name } of rows) {
            const value = distances[name];
            const known = Number.isFinite(value);
            const share = known ? Math.min(1, Math.max(0, 1 - value / scale.end)) : 0;
            fill.style.transform = `scaleX(${share.toFixed(3)})`;
            setHidden(mark, scale.mark === null || !fresh);
            setText(distance, known ? number(value, 2) : words.noDistance);
            item.classList.toggle("is-near", known && scale.mark !== null && share >= scale.mark);
            item.classList.toggle("is-match", name === matchName || name === held);
            item.classList.toggle("is-held", name === held);
        }
    }

    let timer = 0;
    let drawnAt = 0;
    const later = () => {
        if (timer) return;
        timer = setTimeout(() => {
            timer = 0;
            drawnAt = performance.now();
            draw();
        }, Math.max(0, REDRAW_MS - (performance.now() - drawnAt)));
    };
    store.watch(["detail", "gesture", "frame", "source"], later);
    setInterval(later, 400);
}
