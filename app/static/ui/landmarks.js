// The landmarks of a hand, as docs/protocol.md has them in `seen`, as lines and dots in a small picture.
// No page here.

/** The 20 bones: from the wrist or the joint before to each joint, thumb first. */
export const BONES = Object.freeze(
    Array.from({ length: 20 }, (_, index) => [index % 4 ? index : 0, index + 1]),
);

/** Where a picture of `size` [width, height] lies in a `width` x `height` frame, whole and in the middle. */
export function fitted([across, down], width, height) {
    const scale = Math.min(width / across, height / down);
    return { scale, x: (width - across * scale) / 2, y: (height - down * scale) / 2 };
}

/** The landmarks of `seen` in a frame, [[x, y] * 21]; null where there are none. */
export function pointsIn(seen, width, height) {
    const points = seen && seen.landmarks;
    if (!Array.isArray(points) || points.length !== 21) return null;
    const { scale, x, y } = fitted(seen.size, width, height);
    return points.map(([across, down]) => [x + across * scale, y + down * scale]);
}

/** Names of the fingers of `seen` that are stretched, or of those that are bent; doubtful ones are in neither. */
export function fingersOf(seen, areStretched) {
    const fingers = (seen && seen.fingers) || {};
    return Object.keys(fingers).filter((name) => fingers[name] === areStretched);
}
