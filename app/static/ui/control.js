// Who drives: taking control, asking for it, giving it back, and what one is told of that.

import { texts } from "../texts/texts.js";
import { isDriving } from "./page.js";
import { takeOverContent } from "./people.js";

/** What this page wants of control, and what it last knew of it. */
export class Control {
    #link;
    #store;
    #sheets;
    #notices;
    #drove = false; // as the robot said when it last spoke
    #releasing = false; // control was given back, so that losing it is no news
    #asked = false; // for control, of whoever drives

    constructor(link, store, sheets, notices) {
        this.#link = link;
        this.#store = store;
        this.#sheets = sheets;
        this.#notices = notices;
    }

    take(takeover = false) {
        this.#releasing = false;
        this.#link.send("take_control", takeover ? { takeover: true } : {});
    }

    toggle() {
        const { robot } = this.#store.state;
        if (!robot) return;
        if (isDriving(this.#store.state)) {
            this.#releasing = true;
            this.#link.send("release_control");
        } else if (robot.controller) this.#askWhich(robot.controller);
        else this.take();
    }

    handOver(to) {
        this.#releasing = true;
        this.#link.send("hand_over", { to });
    }

    /** A new session drives nothing yet. */
    greeted() {
        this.#drove = false;
    }

    /** The robot spoke. One that is silent for a moment names no driver: nothing is lost by that. */
    robotSpoke(online) {
        const drives = isDriving(this.#store.state);
        if (online) {
            if (this.#drove && !drives && !this.#releasing) {
                this.#notices.show(texts.notices.lostControl);
            }
            this.#drove = drives;
        }
        if (this.#asked && drives) {
            this.#asked = false;
            this.#notices.show(texts.people.yours, { kind: "good", name: "control" });
        }
    }

    /** Whoever drives keeps control. */
    refused() {
        this.#asked = false;
    }

    #ask() {
        const { robot } = this.#store.state;
        this.#releasing = false;
        this.#asked = this.#link.send("ask_control");
        if (this.#asked && robot && robot.controller) {
            this.#notices.show(texts.people.asked(robot.controller), { name: "control" });
        }
    }

    #askWhich(controller) {
        const then = (go) => () => {
            this.#sheets.close();
            go();
        };
        const content = takeOverContent(controller, {
            ask: then(() => this.#ask()),
            take: then(() => this.take(true)),
            cancel: then(() => {}),
        });
        this.#sheets.show("take-over", texts.takeOver.title, content);
    }
}
