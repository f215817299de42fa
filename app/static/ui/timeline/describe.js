// One event in words: an icon, a title, and what there is to say more.

import { texts } from "../../texts/texts.js";
import { describeAction, nameOf, short } from "../words.js";

const words = texts.timeline;

/** Kinds of events that are shown together. */
export const GROUPS = {
    trouble: ["stop", "unconfirmed", "reset", "fault", "robot_lost", "robot_back"],
    driving: ["control", "armed", "disarmed", "gesture", "program", "keys", "hold"],
    teaching: ["enrolled", "changed", "retired", "gallery"],
    server: ["started", "sign_in"],
};

const ICONS = {
    started: "brand",
    control: "person",
    armed: "mode-armed",
    disarmed: "mode-disarmed",
    gesture: "hand",
    program: "mode-moving",
    keys: "keys",
    hold: "mode-holding",
    stop: "mode-stopped",
    unconfirmed: "mode-faulted",
    reset: "check",
    fault: "mode-faulted",
    robot_lost: "nolink",
    robot_back: "link",
    enrolled: "plus",
    changed: "edit",
    retired: "close",
    gallery: "person",
    sign_in: "nolink",
};
const SERIOUS = new Set(["stop", "unconfirmed", "fault", "robot_lost"]);

function titleOf({ kind, data }) {
    const { titles } = words;
    switch (kind) {
        case "control":
            if (!data.who) return titles.given;
            return data.before ? titles.takenOver : titles.taken;
        case "stop":
            return titles.stop(data.category);
        case "retired":
            return titles[data.how](data.gesture);
        case "gallery":
            return data.what === "made" ? titles.galleryMade : titles.galleryDeleted;
        case "sign_in":
            return titles.sign_in(data.count);
        default: {
            const title = titles[kind];
            return typeof title === "function" ? title(data.gesture) : title || kind;
        }
    }
}

/**
 * {icon, title, more, reason, serious} of an event of `GET /api/timeline`: `more` is a list of words,
 * `reason` the server's own ones, in English.
 * @param state of the store: whose session this is, what galleries and robot there are
 */
export function describeEvent(event, { hello, galleries, description }) {
    const { kind, data, duration_s: seconds } = event;
    const session = hello && hello.session;
    const named = (who) => (who === session ? words.you : who);
    const more = [];
    let { reason } = data;
    if (data.gallery && data.gallery !== "shared" && data.what !== "deleted") {
        const gallery = (galleries || []).find(({ id }) => id === data.gallery);
        more.push(gallery ? nameOf(gallery) : words.unknownGallery);
    }
    if (data.action) more.push(describeAction(data.action, description));
    if (kind === "changed") more.push(...data.what.map((part) => words.parts[part] || part));
    if (data.moves === false && data.action && data.action.type !== "stop") more.push(words.ignored);
    if (data.doubt) {
        more.push(texts.sentence.doubts[data.doubt] || data.doubt);
        reason = null; // the same in English
    }
    if (data.by) {
        more.push(words.by[data.by] || data.by);
        if (data.by !== "robot") reason = null;
    }
    if (data.presses) more.push(words.presses(data.presses));
    if (data.version) more.push(data.version);
    const who = data.by === "rest" ? null : data.who || data.before;
    if (who) more.push(named(who));
    if (seconds !== null) more.push(words.seconds(short(seconds)));
    return { icon: ICONS[kind] || "clock", title: titleOf(event), more, reason, serious: SERIOUS.has(kind) };
}
