// Where Tab leads while a sheet is open: round the sheet and what has to stay in reach beside it.

const CAN = "a[href], button, input, select, textarea, iframe, [tabindex]";

const isShown = (element) =>
    element.getClientRects().length > 0 && getComputedStyle(element).visibility === "visible";

/** What Tab stops at in `element`, in the order of the page. */
export function stopsIn(element) {
    return [...element.querySelectorAll(CAN)].filter(
        (each) => each.tabIndex >= 0 && !each.disabled && !each.closest("[inert]") && isShown(each),
    );
}

/** The stop that follows `from`, or comes before it if `back`; round the end to the other one. */
function neighbour(stops, from, back) {
    const wanted = back ? Node.DOCUMENT_POSITION_PRECEDING : Node.DOCUMENT_POSITION_FOLLOWING;
    const beyond = stops.filter((each) => each !== from && from.compareDocumentPosition(each) & wanted);
    return back ? beyond.at(-1) || stops.at(-1) : beyond[0] || stops[0];
}

/**
 * Keep Tab within `places`, elements in the order of the page, until the returned function is called.
 * The stop button is in reach beside a sheet, so the sheet alone would be too narrow a circle.
 */
export function tabCircle(places) {
    function onKey(event) {
        if (event.key !== "Tab" || event.ctrlKey || event.metaKey || event.altKey) return;
        const next = neighbour(places.flatMap(stopsIn), document.activeElement, event.shiftKey);
        if (!next) return;
        event.preventDefault();
        next.focus();
    }
    document.addEventListener("keydown", onKey);
    return () => document.removeEventListener("keydown", onKey);
}
