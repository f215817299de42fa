// The robot's cameras on the page: their pictures, and how old these are.

import { texts } from "../texts/texts.js";
import { button, el, setText } from "./dom.js";
import { number } from "./words.js";

const OLD_MS = 500; // from here on the age of a picture is shown
// What is only glanced at leaves the link and the computer to what is looked at.
const LARGE_HZ = 30;
const SMALL_HZ = 15;

/** One robot camera: draws pictures, shows their age. Opens nothing itself; it is given a feed. */
class CameraView {
    constructor(name, feed, { enlarge, swap }) {
        this.name = name;
        this.feed = feed;
        this.takenAt = 0;
        this.open = false;
        this.visible = false;
        const label = texts.stage.views[name];
        this.canvas = el("canvas", { role: "img", "aria-label": label, width: 320, height: 240 });
        this.age = el("span", { class: "age", data: { part: "age" } });
        this.empty = el("p", { class: "view-empty", text: texts.stage.noPicture });
        this.label = el("span", { text: label });
        const title = el("p", { class: "view-title" }, this.label, this.age);
        this.cover = el("button", {
            type: "button",
            class: "view-cover",
            "aria-label": texts.stage.enlarge(label),
            onclick: () => enlarge(name),
        });
        const swapButton = button("", {
            class: "round small swap",
            "aria-label": texts.stage.swap,
            title: texts.stage.swap,
            iconName: "swap",
            onclick: swap,
        });
        this.element = el(
            "div",
            { class: "view is-empty", data: { view: name } },
            this.canvas,
            this.empty,
            title,
            this.cover,
            el("div", { class: "view-tools" }, swapButton),
        );
        this.context = this.canvas.getContext("bitmaprenderer");
        feed.addEventListener("picture", ({ detail }) => this.#draw(detail));
    }

    /** What the robot's profile calls this camera. */
    rename(label) {
        setText(this.label, label);
        this.canvas.setAttribute("aria-label", label);
        this.cover.setAttribute("aria-label", texts.stage.enlarge(label));
    }

    want(visible) {
        if (visible === this.open) return;
        this.open = visible;
        if (visible) this.feed.open();
        else this.feed.close();
    }

    tick(now) {
        const late = this.takenAt ? now - this.takenAt : 0;
        const old = this.open && late > OLD_MS;
        this.element.classList.toggle("is-old", old);
        setText(this.age, old ? texts.stage.age(number(late / 1000)) : "");
        if (!this.takenAt && this.open) {
            const dead = this.feed.failures > 1;
            setText(this.empty, dead ? texts.stage.noCamera : texts.stage.noPicture);
        }
    }

    #draw({ bitmap, takenAt }) {
        if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
            this.canvas.width = bitmap.width;
            this.canvas.height = bitmap.height;
        }
        this.context.transferFromImageBitmap(bitmap);
        this.takenAt = takenAt;
        this.element.classList.remove("is-empty");
    }
}

/** All of them. `large()` is the name of the view that is large. */
export class CameraViews {
    #all;
    #large;

    constructor(names, feeds, { enlarge, swap, large }) {
        this.#large = large;
        this.#all = names.map((name) => new CameraView(name, feeds[name], { enlarge, swap }));
    }

    [Symbol.iterator]() {
        return this.#all[Symbol.iterator]();
    }

    /** The one with this name, or undefined. */
    named(name) {
        return this.#all.find((view) => view.name === name);
    }

    /** Say how old the pictures are, and how many are wanted. */
    tick(now) {
        for (const view of this.#all) {
            view.feed.mostHz = view.name === this.#large() ? LARGE_HZ : SMALL_HZ;
            view.tick(now);
        }
    }
}
