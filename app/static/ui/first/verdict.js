// What the check of a burst means: take it, or show it again, and why. No page here.

const GENERAL = new Set(["add_photos", "another_sign"]); // advice that a first try does not need

/** A good picture of another sign than the one asked for: who means that sign may keep it. */
const isUnlike = ({ problem }) => problem === "not_the_sign";

/** Problem of most of the pictures, as {code, reason, sign}. */
function worst(images) {
    const counts = new Map();
    for (const { problem } of images) {
        if (problem) counts.set(problem, (counts.get(problem) || 0) + 1);
    }
    const [code] = [...counts].sort((a, b) => b[1] - a[1])[0] || ["unreadable"];
    const found = images.find(({ problem }) => problem === code);
    return { code, reason: (found && found.reason) || "", sign: (found && found.sign) || null };
}

/**
 * @param {object} answer of POST api/gestures/check
 * @param {string} own id of the gesture that is taught: its former pictures do not count
 * @returns {{good, usable, code, reason, other, sign}} `good`: save it; `usable`: it may be kept although it
 *   is weak; `code`: "good", "near", "like", or the problem of the pictures; `other`: name of the
 *   gesture that it may be taken for; `reason`: more about it in the server's plain words, or "";
 *   `sign`: how the hand differs from the sign asked for, for signWords(), where that is the problem
 */
export function verdict(answer, own) {
    const images = answer.images || [];
    if (!images.some(({ accepted }) => accepted)) {
        return { good: false, usable: images.some(isUnlike), other: null, ...worst(images) };
    }
    const others = (answer.confusions || []).filter(
        ({ id, active }) => id !== own && active !== false,
    );
    const likely = others.find(({ level }) => level === "likely");
    const one = likely || others[0];
    if (!one) return { good: true, usable: true, code: "good", reason: "", other: null };
    const hint = (one.advice || []).find(({ code }) => !GENERAL.has(code));
    return {
        good: !likely,
        usable: true,
        code: likely ? "like" : "near",
        reason: hint ? hint.message : "",
        other: one.gesture,
    };
}

/** Those of `pictures` that the check accepted; where it accepted none, those of another sign. */
export function accepted(answer, pictures) {
    const of = (is) => pictures.filter((_, index) => answer.images[index] && is(answer.images[index]));
    const good = of((image) => image.accepted);
    return good.length ? good : of(isUnlike);
}
