// The sheet that enrols a gesture, and changes or deletes one.

import { texts } from "../texts/texts.js";
import { ActionForm } from "./action-form.js";
import { Capture } from "./capture.js";
import { button, el, setText } from "./dom.js";
import { drawing, knownSign, signOf } from "./first/drawing.js";
import { PathView } from "./path-view.js";
import { formerVersions, programCheck } from "./program-check.js";
import { describeError } from "./words.js";

const words = texts.teach;
const MOST_THUMBS = 12;

/**
 * Contents for the sheet. `gesture` is null to enrol a new one. `act` does the work and throws
 * ApiError: {create, update, addSamples, remove, versions, restore, check, forgetPath}. `look(picture,
 * {gesture, sign})` has a picture judged. `view3d` shows the way of a dry run. `done(text, changes,
 * taught)` closes the sheet; `changes` are the ids to take back by what was changed, `taught` the
 * gesture that has new pictures, or null.
 */
export function teachContent({ gesture, store, video, grab, act, look, templateUrl, view3d, done }) {
    const name = el("input", {
        id: "teach-name",
        name: "name",
        type: "text",
        maxlength: "60",
        autocomplete: "off",
        spellcheck: "false",
        required: true,
        value: gesture ? gesture.name : "",
        "aria-describedby": "teach-name-hint",
    });
    const form = new ActionForm(gesture && gesture.action, {
        description: store.state.description,
    });
    const capture = new Capture({
        video,
        store,
        grab,
        check: (picture) => look(picture, { gesture: gesture && gesture.id, sign: signNow() }),
        onTaken: () => setText(problem, ""),
    });
    /** The starter sign that is taught here, if it is one. */
    function signNow() {
        return knownSign(gesture ? gesture.name : name.value.trim().toLowerCase());
    }

    const path = new PathView(view3d, act.forgetPath);
    const problem = el("p", { class: "problem-line", role: "alert", id: "teach-problem" });
    const save = button(gesture ? words.saveChanges : words.save, {
        id: "teach-save",
        class: "primary",
        onclick: () => run(submit),
    });
    const buttons = [save];
    const made = []; // changes, also those of a saving that was refused half-way
    let busy = false;

    async function run(work) {
        if (busy) return;
        busy = true;
        for (const each of buttons) each.disabled = true;
        setText(problem, words.saving);
        problem.classList.add("is-waiting");
        try {
            await work();
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            problem.classList.remove("is-waiting");
            setText(problem, describeError(error));
            if (error.code === "duplicate") name.focus();
        } finally {
            busy = false;
            for (const each of buttons) each.disabled = false;
        }
    }

    function refuse(text, field) {
        problem.classList.remove("is-waiting");
        setText(problem, text);
        if (field) field.focus();
    }

    async function submit() {
        const wanted = name.value.trim();
        if (!wanted) return refuse(words.nameMissing, name);
        if (!form.check()) return refuse("", null);
        if (!gesture) {
            if (!capture.stills.length) return refuse(words.stillsMissing, capture.one);
            const { change, ...now } = await act.create(wanted, form.value(), capture.stills);
            return done(words.saved(wanted), [change], now);
        }
        const changes = {};
        if (wanted !== gesture.name) changes.name = wanted;
        if (form.touched) {
            changes.action = form.value();
            // Refused when somebody else has changed the action since this sheet was opened.
            if (Number.isInteger(gesture.version)) changes.version = gesture.version;
        }
        if (Object.keys(changes).length) made.push((await act.update(gesture.id, changes)).change);
        let taught = null;
        if (capture.stills.length) {
            const { change, ...now } = await act.addSamples(gesture.id, capture.stills);
            made.push(change);
            taught = now;
            capture.clear();
        }
        return done(words.saved(wanted), made, taught);
    }

    const row = el("div", { class: "row end" }, save);
    const content = [
        el(
            "div",
            { class: "field" },
            el("label", { for: "teach-name", text: words.name }),
            name,
            el("p", { class: "quiet", id: "teach-name-hint", text: words.nameHint }),
        ),
        el(
            "fieldset",
            {},
            el("legend", { text: gesture ? words.morePictures : words.pictures }),
            gesture ? enrolled(gesture) : el("p", { class: "quiet", text: words.picturesHint }),
            capture.element,
        ),
        el(
            "fieldset",
            {},
            el("legend", { text: words.action }),
            form.element,
            programCheck({ form, description: store.state.description, check: act.check, path }),
            gesture && gesture.version > 1 ? former() : null,
        ),
        el("div", { class: "sheet-foot" }, problem, row),
    ];
    if (gesture) row.prepend(deletion());

    function former() {
        return formerVersions({
            gesture,
            description: store.state.description,
            list: () => act.versions(gesture.id),
            restore: (version) =>
                run(async () => {
                    const { change } = await act.restore(gesture.id, version);
                    done(texts.check.restored(gesture.name), [change]);
                }),
        });
    }

    function enrolled({ id, samples, updated }) {
        const count = Number.isFinite(samples) ? samples : 1;
        const shown = Math.min(count, MOST_THUMBS);
        return el(
            "div",
            { class: "enrolled" },
            el("p", { class: "quiet", text: words.enrolled(count) }),
            knownSign(gesture.name) && shownSign(),
            el(
                "div",
                { class: "thumbs" },
                ...Array.from({ length: shown }, (_, index) =>
                    el("img", {
                        class: "thumb",
                        alt: "",
                        width: 30,
                        height: 40,
                        src: templateUrl(id, String(updated), index),
                    }),
                ),
            ),
        );
    }

    /** How the sign is held that new pictures are compared with. */
    function shownSign() {
        const text = el("p", { class: "quiet", text: signOf(gesture) });
        return el("div", { class: "teach-sign" }, drawing(gesture, templateUrl), text);
    }

    function deletion() {
        const box = el("div", { class: "deletion" });
        const ask = button(words.delete, {
            id: "teach-delete",
            class: "danger-quiet",
            onclick: () => {
                box.replaceChildren(el("p", { text: words.deleteAsk(gesture.name) }), yes, no);
                no.focus();
            },
        });
        const no = button(words.deleteNo, { onclick: () => box.replaceChildren(ask) });
        const yes = button(words.deleteYes, {
            id: "teach-delete-yes",
            class: "danger",
            onclick: () =>
                run(async () => {
                    const { change } = await act.remove(gesture.id);
                    done(words.deleted(gesture.name), [change]);
                }),
        });
        buttons.push(ask, yes, no);
        box.append(ask);
        return box;
    }

    const close = () => {
        capture.close();
        path.close();
    };
    return { content, focus: name, close };
}
