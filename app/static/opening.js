// Sheets that open when somebody asks for them. What is in them is loaded then: most who drive need none.

import { grabStill } from "./core/jpeg.js";
import { preflight } from "./core/preflight.js";
import { forget } from "./core/sign-in.js";
import { texts } from "./texts/texts.js";
import { showsHand } from "./ui/page.js";
import { preflightContent } from "./ui/preflight.js";
import { askContent } from "./ui/sheets.js";
import { describeError } from "./ui/words.js";

/** Opens them. `robotId()` gives the robot's id, `views` is the stage's, `video` the operator's picture. */
export class Opening {
    #timeline = null;
    #undo = null;

    constructor({ store, api, sheets, notices, galleries, views, video, robotId }) {
        Object.assign(this, { store, api, sheets, notices, galleries, views, video, robotId });
    }

    /** Teach a gesture, or change the one given. */
    async teach(gesture = null) {
        const { api, store, video } = this;
        const { teachContent } = await import("./ui/teach.js");
        const { content, focus, close } = teachContent({
            gesture,
            store,
            video,
            grab: () => grabStill(video),
            look: (picture, known) => api.checkGesture([picture], store.state.gallery, known),
            templateUrl: api.templateUrl,
            act: {
                create: (...gesture) => api.createGesture(...gesture, store.state.gallery),
                update: api.updateGesture,
                addSamples: api.addSamples,
                remove: api.deleteGesture,
                versions: api.versions,
                restore: api.restoreVersion,
                check: (...question) => api.dryRun(this.robotId(), ...question),
                // Where that does not arrive, the 3D view has lost its connection, too.
                forgetPath: (view) => api.hideDryRun(this.robotId(), view).catch(() => {}),
            },
            view3d: this.views.view3d,
            done: async (text, changes, taught = null) => {
                this.sheets.close();
                this.galleries.loadGestures();
                if (taught && showsHand(store.state)) await this.tryNow(taught);
                (await this.#undoing()).did(text, changes);
            },
        });
        const title = gesture ? texts.teach.editTitle(gesture.name) : texts.teach.title;
        this.sheets.show("teach", title, content, { onclose: close, focus });
    }

    /** See whether a gesture that was just taught is known. */
    async tryNow(gesture) {
        const { tryContent } = await import("./ui/try-now.js");
        const { content, focus, close } = tryContent({
            gesture,
            store: this.store,
            video: this.video,
            addPhoto: () => this.teach(gesture),
            done: () => this.sheets.close(),
        });
        this.sheets.show("try", texts.tryNow.title(gesture.name), content, { onclose: close, focus });
    }

    /** Change the gesture with this id, if it is still there. */
    edit(id) {
        const gesture = this.store.state.gestures.find((candidate) => candidate.id === id);
        if (gesture) this.teach(gesture);
    }

    /** Look after all gestures. */
    async manage() {
        const { store, api } = this;
        const { manager } = await import("./managing.js");
        const undo = await this.#undoing();
        const { content, close } = await manager({ store, api, undo, edit: (id) => this.edit(id) });
        this.sheets.show("manager", texts.manager.title, content, { onclose: close });
    }

    /** What happened; closes it where it is open. */
    async timeline() {
        if (this.sheets.name === "timeline") {
            this.sheets.close();
            return;
        }
        const { Timeline } = await import("./ui/timeline/sheet.js");
        this.#timeline ||= new Timeline(this.store, {
            timeline: this.api.timeline,
            eventUrl: this.api.eventUrl,
            file: async (kinds) => {
                const { download } = await import("./core/transfer.js");
                return download(`api/timeline.jsonl?${new URLSearchParams(kinds.map((kind) => ["kind", kind]))}`);
            },
        });
        const { content, close } = await this.#timeline.open();
        this.sheets.show("timeline", texts.timeline.open, content, { onclose: close });
    }

    /** Who is signed in, and the way out; closes it where it is open. */
    async account() {
        if (this.sheets.name === "account") {
            this.sheets.close();
            return;
        }
        const { accountContent } = await import("./ui/account.js");
        const session = await this.api.session().catch(() => null);
        const content = accountContent(session, () => this.#signOut());
        this.sheets.show("account", texts.account.title, content);
    }

    /** Leave. Where the server does not hear of it, the cookie that stays behind opens nothing by itself. */
    async #signOut() {
        await this.api.signOut().catch(() => {});
        forget();
        location.replace("signin");
    }

    /** Try out what the page needs, and say what is missing and how to mend it. */
    async preflight() {
        const { content, show, done } = preflightContent();
        this.sheets.show("preflight", texts.preflight.title, content);
        await preflight(show, { running: this.store.state.source.state === "running" });
        done();
    }

    /** Ask whether the things around the robot are to be put back, and do it. */
    resetScene() {
        const { title, words, yes } = texts.resetScene;
        const go = async () => {
            this.sheets.close();
            try {
                await this.api.resetScene(this.robotId());
                this.notices.show(texts.resetScene.done, { kind: "good", name: "scene" });
            } catch (error) {
                this.notices.show(describeError(error), { kind: "bad", name: "scene" });
            }
        };
        const content = askContent(words, yes, go, () => this.sheets.close());
        this.sheets.show("reset-scene", title, content);
    }

    /** What was changed can be taken back. */
    async #undoing() {
        const { Undo } = await import("./ui/undo.js");
        this.#undo ||= new Undo({ notices: this.notices, undo: this.api.undo });
        return this.#undo;
    }
}
