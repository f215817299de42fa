// The REST interface, as docs/protocol.md has it.

import { proofHeaders, ticket } from "./sign-in.js";

/** What went wrong, with the server's own words where it gave some. */
export class ApiError extends Error {
    constructor(status, code, message, detail = null) {
        super(message);
        this.status = status; // 0: the server was not reached
        this.code = code;
        this.detail = detail;
    }
}

/**
 * Ask the server; gives the answer's JSON. Where gestures were changed it has `change`, the id to
 * take that back by. Throws ApiError.
 */
export async function request(method, path, { body, json, timeoutMs = 15000, keepalive = false } = {}) {
    const headers = proofHeaders();
    const init = { method, headers, credentials: "same-origin", cache: "no-store", keepalive };
    if (json !== undefined) {
        headers["Content-Type"] = "application/json";
        init.body = JSON.stringify(json);
    } else if (body !== undefined) {
        init.body = body;
    }
    let answer;
    try {
        init.signal = AbortSignal.timeout(timeoutMs);
        answer = await fetch(new URL(path, document.baseURI), init);
    } catch {
        throw new ApiError(0, "unreachable", "");
    }
    let data = null;
    try {
        data = await answer.json();
    } catch {
        // 204, or a proxy's own page
    }
    if (answer.ok) {
        const change = answer.headers.get("Farhand-Change");
        return change ? Object.assign(data || {}, { change }) : data;
    }
    const error = (data && data.error) || {};
    throw new ApiError(answer.status, error.code || "http", error.message || "", error.detail);
}

const CHANGE_MS = 60000;

/** The same for what changes gestures: a large gallery is learned anew before the answer. */
export const change = (method, path, options = {}) =>
    request(method, path, { timeoutMs: CHANGE_MS, ...options });

const id = encodeURIComponent;

function imageForm(images) {
    const form = new FormData();
    images.forEach((image, index) => form.append("images", image, `still-${index + 1}.jpg`));
    return form;
}

/** The shared gallery is what is meant where none is named; servers without others know no name. */
const isNamed = (gallery) => Boolean(gallery) && gallery !== "shared";

function inGallery(form, gallery) {
    if (isNamed(gallery)) form.append("gallery", gallery);
    return form;
}

export const api = Object.freeze({
    /** Who is signed in here: {role, token, name, expires}. */
    session: () => request("GET", "api/session"),
    /** Sign this browser out; what it has open ends. */
    signOut: () => request("POST", "api/sign-out"),
    robots: () => request("GET", "api/robots"),
    robot: (robot) => request("GET", `api/robots/${id(robot)}`),
    stopRobot: (robot, timeoutMs) =>
        request("POST", `api/robots/${id(robot)}/stop`, { timeoutMs }),
    /** Put every movable thing back. */
    resetScene: (robot) => request("POST", `api/robots/${id(robot)}/scene/reset`),
    resetRobot: (robot) => request("POST", `api/robots/${id(robot)}/reset`),
    /** When which gesture is shown by the synthetic operator: [{start_s, end_s, gesture}]. */
    operatorCaptions: () => request("GET", "static/media/operator.json"),
    galleries: () => request("GET", "api/galleries"),
    createGallery: (name) => request("POST", "api/galleries", { json: { name } }),
    /** What the owner of a gallery has chosen: {speed, fine, large, glass, language, source}. */
    settings: (gallery) => request("GET", `api/galleries/${id(gallery)}/settings`),
    changeSettings: (gallery, changes) =>
        // Also told when the page is being left.
        request("PATCH", `api/galleries/${id(gallery)}/settings`, { json: changes, keepalive: true }),
    /** A page of what happened, newest first: {events, before, lost}. */
    timeline: ({ kinds = [], before = null } = {}) => {
        const wanted = kinds.map((kind) => ["kind", kind]);
        if (before !== null) wanted.push(["before", before]);
        return request("GET", `api/timeline?${new URLSearchParams(wanted)}`);
    },
    /** Address of an event's "picture.jpg" or "template.png". */
    eventUrl: (event, what) => `api/timeline/${id(event)}/${what}?ticket=${ticket()}`,
    gestures: (gallery) =>
        request("GET", isNamed(gallery) ? `api/gestures?gallery=${id(gallery)}` : "api/gestures"),
    createGesture(name, action, images, gallery) {
        const form = inGallery(imageForm(images), gallery);
        form.append("name", name);
        form.append("action", JSON.stringify(action));
        return change("POST", "api/gestures", { body: form });
    },
    updateGesture: (gesture, changes) =>
        change("PATCH", `api/gestures/${id(gesture)}`, { json: changes }),
    versions: (gesture) => request("GET", `api/gestures/${id(gesture)}/versions`),
    restoreVersion: (gesture, version) =>
        change("POST", `api/gestures/${id(gesture)}/versions/${id(version)}/restore`),
    /** Would an action break a limit? Nothing moves. `show`: {view, still}, to see the way in 3D. */
    dryRun: (robot, action, from, show) =>
        request("POST", `api/robots/${id(robot)}/dry-run`, {
            json: { action, from, ...show },
            timeoutMs: 35000,
        }),
    hideDryRun: (robot, view) => request("DELETE", `api/robots/${id(robot)}/dry-run/${id(view)}`),
    /**
     * Judge pictures as enrolment would; nothing is stored. `gesture` is the id of the one that they are
     * to be more samples of, `sign` the name of the starter sign that they have to show.
     */
    checkGesture(images, gallery, { gesture = null, sign = null } = {}) {
        const form = gesture ? imageForm(images) : inGallery(imageForm(images), gallery);
        if (gesture) form.append("gesture", gesture);
        if (sign) form.append("sign", sign);
        return request("POST", "api/gestures/check", { body: form });
    },
    addSamples: (gesture, images) =>
        change("POST", `api/gestures/${id(gesture)}/samples`, { body: imageForm(images) }),
    /** The same, in place of all samples that there are. */
    replaceSamples: (gesture, images) =>
        change("POST", `api/gestures/${id(gesture)}/samples?replace=true`, {
            body: imageForm(images),
        }),
    /** Take a change of gestures back. */
    undo: (made) => change("POST", `api/changes/${id(made)}/undo`),
    deleteGesture: (gesture) => change("DELETE", `api/gestures/${id(gesture)}`),
    /** Address of a template's picture; `version` makes it new after a change. */
    templateUrl(gesture, version, sample = 0) {
        return `api/gestures/${id(gesture)}/template.png?sample=${sample}&v=${id(version)}&ticket=${ticket()}`;
    },
});
