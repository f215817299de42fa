// Who asks to drive, and the choice between asking and taking over.

import { texts } from "../texts/texts.js";
import { button, el, setHidden, setText, want } from "./dom.js";
import { isDriving } from "./page.js";

/** Shows the one who drives that somebody asks for control: hand it over, or drive on. */
export function askingNotice(host, store) {
    const words = el("p", {});
    let first = "";
    const notice = el(
        "div",
        { class: "notice asking", data: { name: "asking" }, hidden: true },
        words,
        button(texts.people.keep, {
            onclick: () => want(notice, "keep-control"),
            data: { part: "keep" },
        }),
        button(texts.people.handOver, {
            class: "primary",
            onclick: () => want(notice, "hand-over", { to: first }),
            data: { part: "hand-over" },
        }),
    );
    host.append(notice);
    store.watch(["people", "robot", "hello", "connection"], (state) => {
        const asking = state.people ? state.people.asking : [];
        setHidden(notice, !isDriving(state) || !asking.length);
        if (notice.hidden) return;
        first = asking[0];
        setText(words, texts.people.asks(first, asking.length - 1));
    });
}

/** Contents of the sheet for somebody who wants to drive while another does. */
export function takeOverContent(driver, { ask, take, cancel }) {
    return [
        el("p", { text: texts.takeOver.words(driver) }),
        el(
            "div",
            { class: "row end" },
            button(texts.actions.cancel, { onclick: cancel, data: { part: "no" } }),
            button(texts.actions.takeOver, { onclick: take, data: { part: "yes" } }),
            button(texts.people.ask, { class: "primary", onclick: ask, data: { part: "ask" } }),
        ),
    ];
}
