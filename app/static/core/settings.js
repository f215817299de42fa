// What the person has chosen: kept in this browser, and on the server where it is known whose hand it is.

import { SHARED } from "./galleries.js";

const same = { told: (kept) => kept, kept: (told) => told };
const flag = (yes, no) => ({ told: (kept) => kept === yes, kept: (told) => (told ? yes : no) });

/** How each choice reads in the browser's memory, and how the server is told. */
export const FIELDS = {
    speed: { told: Number, kept: String },
    fine: flag("yes", "no"),
    large: same,
    glass: flag("open", "folded"),
    language: same,
    source: same,
};
const SOURCES = ["camera", "synthetic", "keys"];
const SAVE_AFTER_MS = 400; // a slider that is dragged is one change

/**
 * In place of the memory for whoever keeps a choice: `get` and `set` are the memory's own, and what
 * is set goes to the server, too. Tells `loaded` when choices made elsewhere have come into the
 * memory. Without a server, or with the shared gallery, which is nobody's, the memory is all there is.
 */
export class SettingsKeeper extends EventTarget {
    #api;
    #store;
    #memory;
    #unsaved = {};
    #owner = null; // gallery that the unsaved choices are of
    #timer = 0;
    #loaded = null; // [gallery, hello] that choices were last asked for

    constructor(api, store, memory) {
        super();
        this.#api = api;
        this.#store = store;
        this.#memory = memory;
        store.watch(["gallery", "hello", "connection"], () => this.#look());
        window.addEventListener("pagehide", () => this.#save());
    }

    get(name) {
        return this.#memory.get(name);
    }

    set(name, value) {
        if (name === "source" && !SOURCES.includes(value)) return;
        const isNew = this.#memory.get(name) !== value;
        this.#memory.set(name, value);
        const { gallery } = this.#store.state;
        if (!isNew || !FIELDS[name] || gallery === SHARED) return;
        if (this.#owner !== gallery) this.#save();
        this.#owner = gallery;
        this.#unsaved[name] = FIELDS[name].told(value);
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.#save(), SAVE_AFTER_MS);
    }

    /** Resolves when all that was set is kept, or could not be. */
    async flush() {
        await this.#save();
    }

    /** Another person, or another connection: their choices may be others. */
    async #look() {
        const { gallery, hello, connection } = this.#store.state;
        if (connection.state !== "open" || !hello || hello.role === "observer") return;
        const [before, greeting] = this.#loaded || [];
        if (before === gallery && greeting === hello) return;
        this.#loaded = [gallery, hello];
        await this.#save(); // what was chosen while the server was away
        if (gallery !== SHARED) await this.#load(gallery);
    }

    async #load(gallery) {
        let found;
        try {
            found = await this.#api.settings(gallery);
        } catch {
            return; // what the browser remembers stays
        }
        if (gallery !== this.#store.state.gallery) return;
        for (const [name, { kept }] of Object.entries(FIELDS)) {
            const told = found[name];
            // What was chosen here meanwhile is newer.
            if (told === null || told === undefined || name in this.#unsaved) continue;
            this.#memory.set(name, kept(told));
        }
        this.dispatchEvent(new Event("loaded"));
    }

    async #save() {
        clearTimeout(this.#timer);
        const [owner, changes] = [this.#owner, this.#unsaved];
        if (!Object.keys(changes).length) return;
        this.#unsaved = {};
        try {
            await this.#api.changeSettings(owner, changes);
        } catch (error) {
            // Refused for good, or of a person whom somebody else follows here: forgotten.
            if ((error.status && error.status < 500) || this.#owner !== owner) return;
            this.#unsaved = { ...changes, ...this.#unsaved };
        }
    }
}
