// Whose gestures this page is recognised against: the person's own gallery, or the shared one.

export const SHARED = "shared";

/**
 * Keeps the store's `gallery` (an id), `galleries` (those there are; null where the server has only
 * the shared one) and `gestures` true to the server. Tells `lost` when the gallery is gone and the
 * shared one is used in its place.
 */
export class GalleryKeeper extends EventTarget {
    #link;
    #api;
    #store;
    #memory;
    #asked = null; // gallery that the server was asked for and has not answered
    #run = 0;

    constructor(link, api, store, memory) {
        super();
        this.#link = link;
        this.#api = api;
        this.#store = store;
        this.#memory = memory;
        store.set({ gallery: memory.get("gallery") || SHARED });
    }

    /** Whether somebody has said on this browser whose hand it is. */
    get isChosen() {
        return Boolean(this.#memory.get("gallery"));
    }

    /** The server said hello: it knows nothing of this page yet. */
    async greeted() {
        const { gallery, hello } = this.#store.state;
        this.#asked = null;
        // An observer's hand is not looked at.
        if (gallery !== SHARED && !(hello && hello.role === "observer")) this.#use(gallery);
        this.loadGestures();
        await this.list();
    }

    /** Ask which galleries there are. */
    async list() {
        try {
            this.#store.set({ galleries: await this.#api.galleries() });
        } catch (error) {
            // Anything but "no such route" may be better next time.
            if (error.status !== 404) return;
            this.#asked = null;
            this.#store.set({ galleries: null });
            if (this.#store.state.gallery === SHARED) return;
            this.#store.set({ gallery: SHARED });
            this.loadGestures();
        }
    }

    /** The server's `gallery` message: gestures changed, or this session uses another gallery. */
    heard({ gallery }) {
        if (gallery !== undefined) {
            if (this.#asked === gallery) this.#asked = null;
            else if (this.#asked === null && gallery !== this.#store.state.gallery) this.#lost(gallery);
        }
        this.loadGestures();
        if (this.#store.state.galleries) this.list();
    }

    /** An `error` message; says whether it was the answer to what was asked here. */
    refused({ code }) {
        if (this.#asked === null || code !== "not_found") return false;
        this.#asked = null;
        this.#lost(SHARED);
        this.loadGestures();
        return true;
    }

    /** Use a gallery from now on, and on this browser the next time. Resolves with its gestures there. */
    async choose(gallery) {
        this.#memory.set("gallery", gallery);
        if (gallery === this.#store.state.gallery) return;
        this.#store.set({ gallery, gestures: [], gesturesState: "loading" });
        this.#use(gallery);
        await this.loadGestures();
    }

    /** Make a gallery for somebody, and use it. Throws ApiError. */
    async create(name) {
        const { id } = await this.#api.createGallery(name);
        await Promise.all([this.choose(id), this.list()]);
    }

    async loadGestures() {
        const run = ++this.#run;
        const { gallery } = this.#store.state;
        try {
            const gestures = await this.#api.gestures(gallery);
            if (run !== this.#run) return;
            const galleryVersion = this.#store.state.galleryVersion + 1;
            this.#store.set({ gestures, gesturesState: "ready", galleryVersion });
        } catch {
            if (run === this.#run) this.#store.set({ gesturesState: "failed" });
        }
    }

    #use(gallery) {
        if (this.#link.send("use_gallery", { gallery })) this.#asked = gallery;
    }

    #lost(gallery) {
        this.#memory.set("gallery", ""); // asked anew
        this.#store.set({ gallery });
        this.dispatchEvent(new Event("lost"));
    }
}
