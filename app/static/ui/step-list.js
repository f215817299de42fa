// A list of steps, each with a form of its own: what a sequence and a repeat hold.

import { texts } from "../texts/texts.js";
import { button, el } from "./dom.js";

const words = texts.actionForm;
export const MOST_STEPS = 32;

/** `make(action)` gives the form of one step; `actions` are the steps to begin with. */
export class StepList {
    constructor(make, actions) {
        this.make = make;
        this.entries = [];
        this.list = el("ol", { class: "step-list" });
        this.add = button(words.addStep, { iconName: "plus", onclick: () => this.append(null) });
        this.elements = [this.list, this.add];
        for (const action of actions) this.append(action);
    }

    append(action) {
        const form = this.make(action);
        const title = el("span", { class: "step-title" });
        const entry = { form, title };
        entry.up = button("", {
            class: "round small",
            iconName: "up",
            onclick: () => {
                const at = this.entries.indexOf(entry);
                this.entries.splice(at - 1, 2, entry, this.entries[at - 1]);
                this.#redraw();
            },
        });
        entry.remove = button("", {
            class: "round small",
            iconName: "close",
            onclick: () => {
                this.entries.splice(this.entries.indexOf(entry), 1);
                this.#redraw();
            },
        });
        const head = el("div", { class: "step-head" }, title, entry.up, entry.remove);
        entry.item = el("li", {}, head, form.element);
        this.entries.push(entry);
        this.#redraw();
    }

    check() {
        return this.entries.every(({ form }) => form.check());
    }

    value() {
        return this.entries.map(({ form }) => form.value());
    }

    /** Mark the steps whose numbers, from 1, are in the set. */
    mark(numbers) {
        this.entries.forEach(({ item }, index) => {
            item.classList.toggle("has-problem", numbers.has(index + 1));
        });
    }

    #redraw() {
        this.list.replaceChildren(...this.entries.map(({ item }) => item));
        this.entries.forEach(({ title, up, remove }, index) => {
            title.textContent = words.step(index + 1);
            up.setAttribute("aria-label", words.upStep(index + 1));
            remove.setAttribute("aria-label", words.removeStep(index + 1));
            up.disabled = index === 0;
            remove.disabled = this.entries.length === 1;
        });
        this.add.disabled = this.entries.length >= MOST_STEPS;
    }
}
