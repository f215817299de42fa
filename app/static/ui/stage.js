// What the robot sees and how it stands: two cameras and the 3D view, one of them large.

import { texts, told } from "../texts/texts.js";
import { CameraViews } from "./camera-view.js";
import { button, el, setText } from "./dom.js";

const LONG_AWAY_MS = 1500; // a server that starts takes longer
const CAMERAS = ["wrist", "scene"];

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** How this browser draws in three dimensions: "fast", "slow" (without a GPU) or "none". */
function drawing3d() {
    try {
        const context = document.createElement("canvas").getContext("webgl2");
        if (!context) return "none";
        const names = context.getExtension("WEBGL_debug_renderer_info");
        const renderer = context.getParameter(
            names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER,
        );
        const ending = context.getExtension("WEBGL_lose_context");
        if (ending) ending.loseContext();
        return SOFTWARE.test(renderer) ? "slow" : "fast";
    } catch {
        return "none";
    }
}

/** An id that nobody guesses: what a dry run shows in this page's 3D view, it shows nowhere else. */
function newViewId() {
    const bytes = crypto.getRandomValues(new Uint8Array(16));
    return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Address of the 3D view's own connection, which says whose view it is and that it may be seen. */
function viewSocket(id, ticket) {
    const url = new URL(`viser?view=${id}&ticket=${ticket}`, document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    return encodeURIComponent(url.href);
}

/** The 3D view in its frame: loaded when first seen, and again when the server came back. */
class View3d {
    constructor(enlarge, onFrame, { drawing, hidden, onHide, ticket }) {
        this.onFrame = onFrame;
        this.ticket = ticket;
        this.id = newViewId();
        this.visible = false;
        this.drawing = drawing;
        this.frame = null;
        const label = texts.stage.views["3d"];
        this.note = el("p", { class: "view-empty" });
        this.big = button("", {
            class: "round small enlarge",
            "aria-label": texts.stage.enlarge(label),
            iconName: "enlarge",
            onclick: () => enlarge("3d"),
        });
        this.hide = button("", {
            id: "hide-3d",
            class: "round small",
            "aria-label": texts.stage.hide,
            iconName: "close",
            onclick: () => this.setHidden(true),
        });
        this.show = button(texts.stage.show, {
            id: "show-3d",
            onclick: () => this.setHidden(false),
        });
        this.element = el(
            "div",
            { class: "view view-3d is-empty", id: "view-3d", data: { view: "3d" } },
            this.note,
            el(
                "div",
                { class: "view-offer" },
                this.show,
                drawing === "slow" ? el("p", { class: "quiet", text: texts.stage.slow3d }) : null,
            ),
            el("p", { class: "view-title" }, el("span", { text: label })),
            el("div", { class: "view-tools" }, this.big, this.hide),
        );
        this.onHide = onHide;
        this.setHidden(hidden);
    }

    setHidden(hidden, { remember = true } = {}) {
        const before = this.hidden;
        this.hidden = hidden;
        this.element.classList.toggle("is-hidden", hidden);
        this.show.hidden = !hidden;
        this.hide.hidden = hidden;
        this.big.hidden = hidden;
        if (hidden) this.#unload();
        else this.load();
        if (before !== undefined && remember) this.onHide(hidden);
    }

    /** Load the frame if it is wanted, seen, and can be drawn. */
    load() {
        if (this.hidden || !this.visible || this.frame) return;
        if (this.drawing === "none") {
            setText(this.note, texts.stage.no3d);
            return;
        }
        setText(this.note, texts.stage.loading3d);
        this.frame = el("iframe", {
            title: texts.stage.views["3d"],
            // One point a pixel: software WebGL has no speed to spare.
            src: `viser/?fixedDpr=1&websocket=${viewSocket(this.id, this.ticket())}`,
            onload: () => this.#loaded(),
        });
        this.element.prepend(this.frame);
    }

    reload() {
        this.#unload();
        this.load();
    }

    #loaded() {
        try {
            const inner = this.frame.contentWindow;
            const kind = inner.document.contentType;
            if (kind !== "text/html") throw new Error("not a page");
            // The scene alone: no panels, no hints meant for viser's own page.
            const quiet = new inner.CSSStyleSheet();
            quiet.replaceSync(
                ".mantine-Notifications-root, .mantine-Paper-root { display: none !important; }",
            );
            inner.document.adoptedStyleSheets = [quiet];
            this.element.classList.remove("is-empty");
            this.onFrame(inner);
        } catch {
            this.#unload();
            setText(this.note, texts.stage.failed3d);
        }
    }

    #unload() {
        if (this.frame) this.frame.remove();
        this.frame = null;
        this.element.classList.add("is-empty");
        setText(this.note, "");
    }
}

/**
 * Fills `element`. `feeds` maps camera names to feeds; `onFrame(window)` is called with the 3D
 * frame's window, so that keys work in there; `memory` keeps small choices; `ticket()` is what lets the
 * 3D view in. Returns `swap`, which
 * makes the other camera large, `recall`, which makes large what `memory` says, and `view3d`, which can be
 * borrowed: it is then open and large until it is given back, and nothing of that is remembered.
 */
export function stage(element, store, { feeds, onFrame, memory, ticket }) {
    const enlarge = (name) => {
        element.dataset.large = name;
        memory.set("large", name);
    };
    const swap = () => enlarge(element.dataset.large === "wrist" ? "scene" : "wrist");
    const cameras = new CameraViews(CAMERAS, feeds, { enlarge, swap, large: () => element.dataset.large });
    const drawing = drawing3d();
    // Without a GPU the 3D view takes the very processor that the frames need: only if asked for.
    const hidden = (memory.get("hide-3d") || (drawing === "slow" ? "yes" : "no")) === "yes";
    const onHide = (now) => {
        memory.set("hide-3d", now ? "yes" : "no");
        if (now && element.dataset.large === "3d") enlarge("wrist");
    };
    const view3d = new View3d(enlarge, onFrame, { drawing, hidden, onHide, ticket });
    const views = [...cameras, view3d];
    element.append(...views.map((view) => view.element));
    const recall = () => {
        const last = memory.get("large");
        const known = views.some((view) => view.element.dataset.view === last);
        const unseen = last === "3d" && view3d.element.classList.contains("is-hidden");
        if (known && !unseen) element.dataset.large = last;
    };
    recall();

    const update = () => {
        const awake = document.visibilityState !== "hidden";
        const signedIn = store.state.connection.state !== "signed-out";
        for (const camera of cameras) camera.want(awake && signedIn && camera.visible);
        if (awake) view3d.load();
    };
    store.watch(["description"], ({ description }) => {
        for (const { name, title } of (description && description.cameras) || []) {
            const camera = cameras.named(name);
            if (camera && title) camera.rename(told(title));
        }
    });
    const seen = new IntersectionObserver(
        (entries) => {
            for (const entry of entries) {
                const view = views.find((candidate) => candidate.element === entry.target);
                view.visible = entry.isIntersecting;
            }
            update();
        },
        { rootMargin: "80px" },
    );
    for (const view of views) seen.observe(view.element);
    document.addEventListener("visibilitychange", update);
    setInterval(() => {
        cameras.tick(performance.now());
    }, 200);

    let was = null;
    let lostAt = null;
    store.watch(["connection"], ({ connection }) => {
        const name = connection.state;
        if (name === was) return;
        was = name;
        update();
        const now = performance.now();
        if (name !== "open") {
            lostAt ??= now;
            return;
        }
        // The server may have started anew; the 3D view then waits for a click before it returns.
        if (lostAt !== null && now - lostAt > LONG_AWAY_MS && view3d.frame) view3d.reload();
        lostAt = null;
    });

    let lent = null; // how it was before
    const borrowed = {
        id: view3d.id,
        canDraw: drawing !== "none",
        get isHidden() {
            return view3d.hidden;
        },
        borrow() {
            lent ??= { large: element.dataset.large, hidden: view3d.hidden };
            element.dataset.large = "3d";
            document.documentElement.classList.add("has-path");
            view3d.visible = true;
            view3d.setHidden(false, { remember: false });
        },
        giveBack() {
            if (!lent) return;
            element.dataset.large = lent.large;
            document.documentElement.classList.remove("has-path");
            if (lent.hidden) view3d.setHidden(true, { remember: false });
            lent = null;
        },
    };
    return { swap, recall, view3d: borrowed };
}
