// What happened, newest first: by day, with pictures, growing while it is looked at.

import { language, texts } from "../../texts/texts.js";
import { button, el, icon, saveFile, setText } from "../dom.js";
import { describeError } from "../words.js";
import { describeEvent, GROUPS } from "./describe.js";

const words = texts.timeline;
const STYLES = "static/styles/timeline.css";
const FRESH_EVERY_MS = 1000;
const day = new Intl.DateTimeFormat(language, { weekday: "long", day: "numeric", month: "long", year: "numeric" });
const clock = new Intl.DateTimeFormat(language, { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });

/** Made once; `open` gives what to show on a sheet. `api` {timeline(), eventUrl(), file()} */
export class Timeline {
    #store;
    #api;
    #list = el("div", { class: "timeline-days", id: "timeline-days" });
    #note = el("p", { class: "quiet", role: "status" });
    #filter;
    #older = button(words.older, { id: "timeline-older", onclick: () => this.#load(this.#before) });
    #save = button(words.save, { class: "timeline-save quiet-button", id: "timeline-save", onclick: () => this.#keep() });
    #events = new Map(); // by id
    #rows = new Map(); // by id: {key, item}
    #before = null; // asks for the next page
    #run = 0;
    #open = false;
    #timer = 0;

    constructor(store, api) {
        this.#store = store;
        this.#api = api;
        const options = Object.entries(words.filters).map(([value, text]) => el("option", { value, text }));
        this.#filter = el("select", { id: "timeline-filter", onchange: () => this.#again() }, ...options);
        store.watch(["timeline"], () => {
            if (this.#open && !this.#timer) this.#timer = setTimeout(() => this.#fresh(), FRESH_EVERY_MS);
        });
    }

    /** Contents of the sheet, and what to call when it is closed. */
    async open() {
        if (!document.querySelector(`link[href="${STYLES}"]`)) {
            document.head.append(el("link", { rel: "stylesheet", href: STYLES }));
        }
        this.#open = true;
        this.#again();
        const head = el(
            "div",
            { class: "timeline-head" },
            el("label", { for: this.#filter.id, text: words.filter }),
            this.#filter,
            this.#save,
        );
        // The filter does not get the focus: in a field the keys for stopping mean something else.
        return {
            content: [head, this.#list, this.#note, this.#older],
            close: () => {
                this.#open = false;
            },
        };
    }

    get #kinds() {
        return GROUPS[this.#filter.value] || [];
    }

    /** From the newest one on. */
    #again() {
        this.#events.clear();
        this.#rows.clear();
        this.#list.replaceChildren();
        setText(this.#note, words.loading);
        this.#older.hidden = true;
        this.#load(null);
    }

    /** Everything as a file. */
    async #keep() {
        try {
            saveFile(await this.#api.file(this.#kinds));
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            setText(this.#note, error.status ? describeError(error) : words.failed);
        }
    }

    async #fresh() {
        await this.#load(null);
        this.#timer = 0;
    }

    async #load(before) {
        const run = before === null && this.#events.size ? this.#run : ++this.#run;
        let page;
        try {
            page = await this.#api.timeline({ kinds: this.#kinds, before });
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            if (run === this.#run) setText(this.#note, error.status ? describeError(error) : words.failed);
            return;
        }
        if (run !== this.#run || !this.#open) return;
        const { events, lost } = page;
        const joins = events.some(({ id }) => this.#events.has(id));
        if (before === null && !joins) this.#events.clear(); // what lies between is not known
        for (const event of events) this.#events.set(event.id, event);
        if (before !== null || !joins) this.#before = page.before;
        this.#older.hidden = this.#before === null;
        setText(this.#note, lost ? words.lost(lost) : this.#events.size ? "" : words.none);
        this.#draw();
    }

    #draw() {
        const newestFirst = [...this.#events.values()].sort((one, two) => two.id - one.id);
        const days = new Map();
        for (const event of newestFirst) {
            const name = day.format(new Date(event.time));
            if (!days.has(name)) days.set(name, []);
            days.get(name).push(this.#row(event));
        }
        const sections = [...days].map(([name, items]) =>
            el("section", {}, el("h3", { text: name }), el("ol", {}, ...items)),
        );
        this.#list.replaceChildren(...sections);
    }

    /** The event's row; the same element while nothing about it changes. */
    #row(event) {
        const key = JSON.stringify([event.duration_s, event.picture, event.data]);
        const known = this.#rows.get(event.id);
        if (known && known.key === key) return known.item;
        const item = this.#item(event);
        this.#rows.set(event.id, { key, item });
        return item;
    }

    #item(event) {
        const said = describeEvent(event, this.#store.state);
        const time = new Date(event.time);
        const picture = (file, alt, kind) =>
            el("img", { class: kind, src: this.#api.eventUrl(event.id, file), alt, loading: "lazy" });
        return el(
            "li",
            { class: said.serious ? "event is-serious" : "event", data: { kind: event.kind, id: event.id } },
            icon(said.icon),
            el(
                "div",
                { class: "event-body" },
                el(
                    "p",
                    { class: "event-line" },
                    el("span", { class: "event-title", text: said.title }),
                    el("time", { datetime: event.time, text: clock.format(time) }),
                ),
                said.more.length ? el("p", { class: "quiet", text: said.more.join(" · ") }) : null,
                said.reason ? el("p", { class: "quiet", lang: "en", text: said.reason }) : null,
                event.picture || event.template
                    ? el(
                          "p",
                          { class: "event-pictures" },
                          event.picture ? picture("picture.jpg", words.robot, "event-robot") : null,
                          event.template ? picture("template.png", words.hand, "event-hand") : null,
                      )
                    : null,
            ),
        );
    }
}
