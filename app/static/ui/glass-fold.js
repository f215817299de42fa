// The glass box in the operator's card: folded, one sentence; open, every step of the recognition.

import { texts } from "../texts/texts.js";
import { el, icon, setText, want } from "./dom.js";
import { showsHand } from "./page.js";
import { thoughtFor } from "./thought.js";

const SHOW_EVERY_MS = 250; // eyes do not follow thirty sentences a second

/** Fills `element`. The steps are loaded when it is first opened; `templateUrl` as the api's. */
export function glassFold(element, store, { templateUrl }) {
    const toggle = el(
        "button",
        {
            type: "button",
            class: "glass-toggle",
            id: "glass-toggle",
            "aria-controls": "glass-body",
            onclick: () => want(element, "glass", { open: !store.state.glass }),
        },
        el("span", { class: "label", text: texts.glass.title }),
        icon("fold"),
    );
    const sentence = el("p", { class: "glass-sentence", id: "glass-sentence" });
    const body = el("div", { class: "glass-body", id: "glass-body" });
    element.append(el("div", { class: "glass-head" }, toggle, sentence), body);

    let loading = false;
    async function fill() {
        if (loading) return;
        loading = true;
        try {
            const { glassBox } = await import("./glass/box.js");
            body.replaceChildren();
            glassBox(body, store, { templateUrl });
        } catch {
            body.replaceChildren(el("p", { class: "quiet", text: texts.glass.failed }));
            loading = false; // opening it again tries again
        }
    }

    store.watch(["glass", "source"], (state) => {
        const open = state.glass && showsHand(state);
        element.hidden = !showsHand(state);
        toggle.setAttribute("aria-expanded", String(open));
        body.hidden = !open;
        element.classList.toggle("is-open", open);
        if (open) fill();
    });

    let saidAt = -Infinity;
    let timer = 0;
    function say() {
        clearTimeout(timer);
        timer = 0;
        const now = performance.now();
        const wait = SHOW_EVERY_MS - (now - saidAt);
        if (wait > 0) {
            timer = setTimeout(say, wait);
            return;
        }
        const text = thoughtFor(store.state, now);
        if (text !== sentence.textContent) saidAt = now;
        setText(sentence, text);
    }
    store.watch(["frame", "detail", "source", "connection"], () => {
        if (!timer) say();
    });
    setInterval(() => {
        if (!timer) say(); // age changes without a message
    }, 500);
}
