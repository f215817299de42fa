// Making elements. Words from the server only ever become text, never markup.

const SVG = "http://www.w3.org/2000/svg";
const ICONS = "static/icons/icons.svg";

/** An SVG icon from the sheet icons/icons.svg; decoration only, so hidden from readers. */
export function icon(name) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("class", "icon");
    svg.setAttribute("aria-hidden", "true");
    const use = document.createElementNS(SVG, "use");
    use.setAttribute("href", `${ICONS}#${name}`);
    svg.append(use);
    return svg;
}

/** Show another icon in an element made by icon(). */
export function setIcon(svg, name) {
    const href = `${ICONS}#${name}`;
    const use = svg.firstChild;
    if (use.getAttribute("href") !== href) use.setAttribute("href", href);
}

/**
 * An element: el("p", {class: "quiet", text: "…", data: {test: "x"}}, child, child).
 * Keys beginning with "on" are listeners; the others are attributes (false and null: left out).
 */
export function el(tag, properties = {}, ...children) {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(properties)) {
        if (value === null || value === undefined || value === false) continue;
        if (key === "text") element.textContent = value;
        else if (key === "data") Object.assign(element.dataset, value);
        else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
        else element.setAttribute(key, value === true ? "" : value);
    }
    element.append(...children.filter((child) => child !== null && child !== undefined));
    return element;
}

export function button(label, { iconName = null, ...properties } = {}) {
    return el(
        "button",
        { type: "button", ...properties },
        iconName ? icon(iconName) : null,
        el("span", { class: "label", text: label }),
    );
}

/** Change text only when it differs: readers and layout are left alone otherwise. */
export function setText(element, text) {
    if (element.textContent === text) return;
    const only = element.firstChild;
    // A text that changes costs less than one that takes another's place.
    if (only && only === element.lastChild && only.nodeType === Node.TEXT_NODE) only.data = text;
    else element.textContent = text;
}

/** `hidden` that is set again, though it was, has the styles calculated anew. */
export function setHidden(element, hidden) {
    if (element.hidden !== hidden) element.hidden = hidden;
}

let colours = new Map();
for (const scheme of ["(prefers-color-scheme: dark)", "(prefers-contrast: more)"]) {
    window.matchMedia(scheme).addEventListener("change", () => {
        colours = new Map();
    });
}

/** A colour of constants.css, for a canvas. To ask the browser each time would have it lay out. */
export function colour(name) {
    if (!colours.has(name)) {
        const style = getComputedStyle(document.documentElement);
        colours.set(name, style.getPropertyValue(name).trim());
    }
    return colours.get(name);
}

export function setLabel(buttonElement, label) {
    setText(buttonElement.querySelector(".label"), label);
}

/** A stylesheet that is not needed at first, before anything that needs it is shown. */
export async function loadStyles(href) {
    if (document.querySelector(`link[href="${href}"]`)) return;
    const link = el("link", { rel: "stylesheet", href });
    const loaded = new Promise((go) => {
        link.addEventListener("load", go);
        link.addEventListener("error", go);
    });
    document.head.append(link);
    await loaded;
}

export function part(root, name) {
    const found = root.querySelector(`[data-part="${name}"]`);
    if (!found) throw new Error(`no part "${name}" in #${root.id}`);
    return found;
}

/** Tell the page what the person wants: "farhand:want" with detail {what, ...}. */
export function want(element, what, detail = {}) {
    element.dispatchEvent(
        new CustomEvent("farhand:want", { bubbles: true, detail: { what, ...detail } }),
    );
}

// Not `instanceof`: the 3D view's frame has an Element class of its own.
const within = (element, selector) =>
    Boolean(element && element.closest && element.closest(selector));

/**
 * Whether somebody types in this element. A slider takes no letters and no Space: both go on meaning
 * what they mean elsewhere.
 */
export const isTyped = (element) =>
    within(element, "input:not([type=range]), textarea, [contenteditable]");

/** Whether letters and arrows belong to this element: somebody types in it or chooses with it. */
export const isField = (element) => isTyped(element) || within(element, "select");

/** A picture in base64 as an ImageBitmap; null when it is none. */
export async function bitmapFromBase64(text, type = "image/png") {
    try {
        const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
        return await createImageBitmap(new Blob([bytes], { type }));
    } catch {
        return null;
    }
}

/** Hand a file to the browser, which saves it where it saves files. */
export function saveFile({ blob, name }) {
    const address = URL.createObjectURL(blob);
    el("a", { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 60000);
}
