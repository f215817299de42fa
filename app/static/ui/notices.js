// Short messages that go away by themselves, or stay when they must be seen.

import { texts } from "../texts/texts.js";
import { button, el } from "./dom.js";

const STAY_MS = 6000;
const MOST = 3;

export class Notices {
    #host;

    constructor(host) {
        this.#host = host;
    }

    /** Show `text`; kind is "info", "good" or "bad". `name` replaces a notice of the same name. */
    show(text, { kind = "info", name = text, stay = false } = {}) {
        this.clear(name);
        const notice = el(
            "div",
            { class: `notice ${kind}`, data: { name } },
            el("p", { text }),
            button("", {
                class: "round small quiet-button",
                iconName: "close",
                "aria-label": texts.notices.dismiss,
                onclick: () => notice.remove(),
            }),
        );
        this.#host.append(notice);
        while (this.#host.children.length > MOST) this.#host.firstChild.remove();
        if (!stay) setTimeout(() => notice.remove(), STAY_MS);
    }

    clear(name) {
        for (const notice of [...this.#host.children]) {
            if (notice.dataset.name === name) notice.remove();
        }
    }
}
