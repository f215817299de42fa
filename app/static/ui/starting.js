// From a page just opened to somebody who drives: choose a picture, or go through the first minutes.

import { texts } from "../texts/texts.js";
import { button, el, want } from "./dom.js";
import { isOwn, isReturning, readProgress } from "./first/plan.js";
import { sourceChoices } from "./operator-view.js";

/**
 * @param host element that wishes are told from
 * @param source {start(wanted), stop()}: the picture
 * @param galleries {isChosen, choose(id), create(name)}
 * @param act {takeControl(), disarm(), take(), check(pictures), save(gesture, pictures), told(text)}
 */
export class Starting {
    constructor({ host, sheets, store, memory, video, source, galleries, act, templateUrl }) {
        Object.assign(this, { host, sheets, store, memory, video, source, galleries, act, templateUrl });
        store.watch(["gallery"], ({ gallery }) => {
            if (gallery !== this.#gallery) store.set({ first: this.progress.get() });
            this.#gallery = gallery;
        });
    }

    #gallery = null;
    #first = null;

    /** What this browser remembers of the first minutes with the gallery in use. */
    progress = {
        get: () => readProgress(this.memory.get(`first-${this.store.state.gallery}`)),
        set: (first) => {
            this.memory.set(`first-${this.store.state.gallery}`, JSON.stringify(first));
            this.store.set({ first });
        },
    };

    /** The button "Start driving". Who has been here before only chooses a picture. */
    start() {
        if (!isReturning(this.store.state, this.progress.get())) return this.first();
        return this.#choosePicture();
    }

    #choosePicture() {
        const choices = sourceChoices(this.host, "start");
        const box = el("div", { class: "choices-row" }, ...choices);
        const last = choices.find(({ id }) => id === `start-${this.memory.get("source")}`);
        this.sheets.show("start", texts.actions.start, box, { focus: last || choices[0] });
    }

    /** Start a picture, or turn it off. */
    async choose(wanted) {
        const starting = this.sheets.name === "start";
        if (starting) this.sheets.close();
        if (wanted.kind === "none") {
            this.source.stop();
            return;
        }
        await this.source.start(wanted);
        const { robot, source } = this.store.state;
        // "Start driving" goes on by itself as far as nothing can move yet.
        const free = robot && !robot.fault && !robot.controller;
        if (starting && free && source.state === "running") this.act.takeControl();
    }

    /** The first minutes, from where they were left; `again`: from their beginning. */
    async first(again = false) {
        // Loaded when first needed: most who come have been here before.
        const { FirstMinutes } = await import("./first/flow.js");
        const { host, sheets, store, video, progress, templateUrl, galleries, act } = this;
        this.#first ||= new FirstMinutes({
            host,
            sheets,
            store,
            video,
            progress,
            templateUrl,
            told: act.told,
            act: {
                ...act,
                isChosen: () => galleries.isChosen,
                choose: (id) => galleries.choose(id),
                create: (name) => galleries.create(name),
                drive: () => this.#choosePicture(),
            },
        });
        await (again ? this.#first.again() : this.#first.open());
    }

    /** The sheet that asks whose hand it is. */
    async whose() {
        const { whoseContent } = await import("./first/whose.js");
        const { galleries, store, sheets } = this;
        const { content, focus } = whoseContent({
            store,
            act: { choose: (id) => galleries.choose(id), create: (name) => galleries.create(name) },
            done: () => {
                sheets.close();
                // Who is new has their own gestures to teach.
                if (!isReturning(store.state, this.progress.get())) want(this.host, "first");
            },
        });
        if (isOwn(store.state)) {
            const again = () => this.first(true);
            const offer = button(texts.first.again, { id: "first-again", onclick: again });
            content.push(el("div", { class: "row end" }, offer));
        }
        sheets.show("whose", texts.first.whose.title, content, { focus });
    }
}
