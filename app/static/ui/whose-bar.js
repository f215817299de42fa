// Under the gestures' heading: whose they are, and the way into the first minutes.

import { texts } from "../texts/texts.js";
import { button, setLabel, want } from "./dom.js";
import { isReturning } from "./first/plan.js";
import { nameOf } from "./words.js";

const words = texts.first;

/** The store's `first` is the progress of the gallery in use; see FRESH in first/plan.js. */
export function whoseBar(element, store) {
    const whose = button("", {
        id: "whose-open",
        class: "quiet-button",
        iconName: "person",
        onclick: () => want(element, "whose"),
    });
    const first = button("", { id: "first-open", onclick: () => want(element, "first") });
    element.append(whose, first);
    store.watch(["galleries", "gallery", "gestures", "first"], (state) => {
        const { galleries, gallery } = state;
        const mine = (galleries || []).find(({ id }) => id === gallery);
        whose.hidden = !mine;
        if (mine) setLabel(whose, words.whose.open(nameOf(mine)));
        first.hidden = isReturning(state, state.first);
        setLabel(first, state.first.begun ? words.goOn : words.begin);
        element.hidden = whose.hidden && first.hidden;
    });
}
