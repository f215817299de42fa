// One gesture in the manager: its picture, what it does, and its samples when they are unfolded.

import { texts } from "../../texts/texts.js";
import { button, el, setLabel, setText } from "../dom.js";
import { describeAction } from "../words.js";

const words = texts.manager;

/**
 * `element` goes into the list and stays the same; `update` draws what changed into it.
 * @param act, change, edit as in manager.js
 */
export class ManagedRow {
    #gesture = null;
    #others = [];
    #chosen = null; // id of the sample that something is to be done with

    constructor({ templateUrl, act, change, edit }) {
        Object.assign(this, { templateUrl, act, change, edit });
        this.picture = el("img", { class: "thumb", alt: "", width: 30, height: 40 });
        this.name = el("p", { class: "managed-name" });
        this.says = el("p", { class: "quiet" });
        this.fold = button("", { class: "quiet-button", "aria-expanded": "false", onclick: () => this.#unfold() });
        this.retire = button("", { class: "quiet-button", onclick: () => this.#retire() });
        this.rename = button(words.rename, { class: "quiet-button", onclick: () => this.#askName() });
        this.more = button(words.change, { class: "quiet-button", onclick: () => edit(this.#gesture.id) });
        this.head = el("div", { class: "managed-head" }, this.picture, el("div", {}, this.name, this.says));
        this.body = el("div", { class: "managed-body" });
        this.body.hidden = true;
        this.form = null;
        this.element = el(
            "li",
            {},
            this.head,
            el("div", { class: "managed-tools" }, this.fold, this.rename, this.retire, this.more),
            this.body,
        );
    }

    update(gesture, gestures, description) {
        this.#gesture = gesture;
        this.#others = gestures.filter(({ id }) => id !== gesture.id);
        const { id, name, active, samples, updated } = gesture;
        const retired = active === false;
        this.element.dataset.id = id;
        this.element.classList.toggle("is-retired", retired);
        const source = this.templateUrl(id, String(updated));
        if (this.picture.getAttribute("src") !== source) this.picture.src = source;
        setText(this.name, name);
        const does = describeAction(gesture.action, description);
        setText(this.says, retired ? words.saysRetired(does) : does);
        setLabel(this.fold, words.pictures(samples));
        setLabel(this.retire, retired ? words.bringBack : words.retire);
        // Every row has the same buttons; read aloud, each says whose it is.
        this.fold.setAttribute("aria-label", words.picturesOf(name, samples));
        this.retire.setAttribute("aria-label", (retired ? words.bringBackOf : words.retireOf)(name));
        this.rename.setAttribute("aria-label", words.renameOf(name));
        this.more.setAttribute("aria-label", texts.gestures.edit(name));
        if (!gesture.sample_ids.includes(this.#chosen)) this.#chosen = null;
        if (!this.body.hidden) this.#drawSamples();
    }

    focus() {
        this.fold.focus();
    }

    #unfold() {
        this.body.hidden = !this.body.hidden;
        this.fold.setAttribute("aria-expanded", String(!this.body.hidden));
        if (!this.body.hidden) this.#drawSamples();
    }

    #drawSamples() {
        const { id, updated, name, sample_ids: ids } = this.#gesture;
        const had = this.body.contains(document.activeElement) && document.activeElement.dataset.sample;
        const samples = ids.map((sample, index) =>
            el(
                "li",
                {},
                el(
                    "button",
                    {
                        type: "button",
                        class: "sample",
                        "aria-pressed": String(sample === this.#chosen),
                        "aria-label": words.sample(index + 1, ids.length),
                        data: { sample },
                        onclick: () => this.#choose(sample),
                    },
                    el("img", {
                        class: "thumb",
                        alt: "",
                        width: 36,
                        height: 48,
                        loading: "lazy",
                        src: this.templateUrl(id, String(updated), index),
                    }),
                ),
            ),
        );
        this.body.replaceChildren(
            el("ul", { class: "samples", "aria-label": words.samplesOf(name) }, ...samples),
            this.#chosen ? this.#sampleTools() : el("p", { class: "quiet", text: words.choose }),
        );
        const again = had && this.body.querySelector(`[data-sample="${CSS.escape(had)}"]`);
        if (again) again.focus();
    }

    #choose(sample) {
        this.#chosen = sample === this.#chosen ? null : sample;
        this.#drawSamples();
    }

    #sampleTools() {
        const { id, name, sample_ids: ids } = this.#gesture;
        const sample = this.#chosen;
        if (ids.length === 1) return el("p", { class: "quiet", text: words.lastSample });
        const number = ids.indexOf(sample) + 1;
        const remove = button(words.deleteSample(number), {
            class: "danger-quiet",
            onclick: () => this.change(() => this.act.deleteSample(id, sample), words.sampleDeleted(name)),
        });
        const to = el(
            "select",
            { "aria-label": words.moveTo },
            ...this.#others.map((other) => el("option", { value: other.id, text: other.name })),
        );
        const move = button(words.move(number), {
            onclick: () =>
                this.change(
                    () => this.act.moveSample(id, sample, to.value),
                    words.sampleMoved(name, to.selectedOptions[0].text),
                ),
        });
        const way = this.#others.length ? el("div", { class: "move" }, to, move) : null;
        return el("div", { class: "sample-tools" }, remove, way);
    }

    #retire() {
        const { id, name, active } = this.#gesture;
        const wanted = active === false;
        this.change(() => this.act.retire(id, wanted), (wanted ? words.broughtBack : words.retired)(name));
    }

    #askName() {
        if (this.form) return this.form.querySelector("input").focus();
        const { id, name } = this.#gesture;
        const field = el("input", { type: "text", maxlength: "60", autocomplete: "off", spellcheck: "false", required: true, value: name, "aria-label": words.newName(name) });
        const end = () => {
            this.form.remove();
            this.form = null;
            this.rename.focus();
        };
        const submit = async (event) => {
            event.preventDefault();
            const wanted = field.value.trim();
            if (wanted === this.#gesture.name) return end();
            if (!wanted) return field.reportValidity();
            if (await this.change(() => this.act.rename(id, wanted), words.renamed(name, wanted))) end();
            else field.focus();
        };
        this.form = el(
            "form",
            { class: "rename", onsubmit: submit },
            field,
            el("button", { type: "submit", class: "primary", text: words.rename }),
            button(texts.actions.cancel, { onclick: end }),
        );
        this.head.after(this.form);
        field.select();
        field.focus();
    }
}
