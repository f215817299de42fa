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

    /**
     * Show `text`; kind is "info", "good" or "bad". `name` replaces a notice of the same name.
     * `act` {label, id, run} puts a button into it, which ends it.
     */
    show(text, { kind = "info", name = text, stay = false, act = null, stayMs = STAY_MS } = {}) {
        this.clear(name);
        const notice = el(
            "div",
            { class: `notice ${kind}`, data: { name } },
            el("p", { text }),
            act
                ? button(act.label, {
                      id: act.id,
                      onclick: () => {
                          notice.remove();
                          act.run();
                      },
                  })
                : null,
            button("", {
                class: "round small quiet-button",
                iconName: "close",
                "aria-label": texts.notices.dismiss,
                onclick: () => notice.remove(),
            }),
        );
        this.#host.append(notice);
        while (this.#host.children.length > MOST) this.#host.firstChild.remove();
        if (!stay) this.#later(notice, stayMs);
    }

    /** Take it away after a while, but not from under somebody's hand. */
    #later(notice, ms) {
        setTimeout(() => {
            if (notice.matches(":hover, :focus-within")) this.#later(notice, STAY_MS);
            else notice.remove();
        }, ms);
    }

    clear(name) {
        for (const notice of [...this.#host.children]) {
            if (notice.dataset.name === name) notice.remove();
        }
    }
}
