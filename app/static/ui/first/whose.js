// Whose hand is it? Choose somebody's gestures, or begin somebody's own.

import { texts } from "../../texts/texts.js";
import { button, el, icon, setText } from "../dom.js";
import { describeError, nameOf } from "../words.js";

const words = texts.first.whose;

/**
 * Contents: who there is, and a field for somebody new.
 * @param act {choose(id), create(name)}: both resolve once the gallery is in use; create throws ApiError
 * @param done {function()} called once somebody is chosen
 */
export function whoseContent({ store, act, done }) {
    const { galleries, gallery: now } = store.state;
    const problem = el("p", { class: "problem-line", role: "alert" });
    const name = el("input", {
        id: "whose-name",
        name: "name",
        type: "text",
        maxlength: "60",
        autocomplete: "nickname",
        spellcheck: "false",
        required: true,
    });
    const add = button(words.add, { id: "whose-add", class: "primary", type: "submit" });

    async function create(event) {
        event.preventDefault();
        const wanted = name.value.trim();
        if (!wanted) {
            setText(problem, words.nameMissing);
            name.focus();
            return;
        }
        add.disabled = true;
        setText(problem, "");
        try {
            await act.create(wanted);
            done();
        } catch (error) {
            if (typeof error.status !== "number") throw error; // a mistake of the page
            setText(problem, describeError(error));
            name.focus();
        } finally {
            add.disabled = false;
        }
    }

    const one = (gallery) =>
        el(
            "li",
            {},
            el(
                "button",
                {
                    type: "button",
                    class: "choice",
                    data: { gallery: gallery.id },
                    "aria-pressed": String(gallery.id === now),
                    onclick: async () => {
                        await act.choose(gallery.id);
                        done();
                    },
                },
                icon(gallery.id === now ? "check" : "person"),
                el("span", { class: "choice-title", text: nameOf(gallery) }),
                el("span", {
                    class: "choice-words",
                    text: gallery.shared ? words.sharedWords : words.taught(gallery.taught, gallery.gestures),
                }),
            ),
        );

    const form = el(
        "form",
        { class: "field", novalidate: true, onsubmit: create },
        el("label", { for: "whose-name", text: words.newName }),
        el("div", { class: "whose-new" }, name, add),
        problem,
    );
    return {
        content: [
            el("p", { class: "quiet", text: words.intro }),
            form,
            el("ul", { class: "choices-row", id: "whose-list", "aria-label": words.known }, ...(galleries || []).map(one)),
        ],
        focus: name,
        close() {},
    };
}
