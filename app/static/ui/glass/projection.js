// The taught templates and the hand on the first two principal components.

import { prepare } from "./canvas.js";

const EDGE = 12; // px that stay free
const FONT = "600 11px system-ui, sans-serif";

const MARKS = {
    other(context, x, y) {
        context.beginPath();
        context.arc(x, y, 1.8, 0, 2 * Math.PI);
        context.fill();
    },
    first(context, x, y) {
        context.fillRect(x - 3.5, y - 3.5, 7, 7);
    },
    second(context, x, y) {
        context.beginPath();
        context.moveTo(x, y - 4.5);
        context.lineTo(x + 4.5, y + 3.5);
        context.lineTo(x - 4.5, y + 3.5);
        context.closePath();
        context.stroke();
    },
    you(context, x, y) {
        context.beginPath();
        context.arc(x, y, 5.5, 0, 2 * Math.PI);
        context.moveTo(x - 9, y);
        context.lineTo(x + 9, y);
        context.moveTo(x, y - 9);
        context.lineTo(x, y + 9);
        context.stroke();
    },
};

/** Places of a plot: from the templates' own numbers to pixels, the same scale on both axes. */
export function placer(points, width, height) {
    const range = (values) => {
        const low = Math.min(...values);
        const high = Math.max(...values);
        return [(low + high) / 2, Math.max(high - low, 1e-6)];
    };
    const [x, wide] = range(points.map((point) => point[0]));
    const [y, high] = range(points.map((point) => point[1]));
    const scale = Math.min((width - 2 * EDGE) / wide, (height - 2 * EDGE) / high);
    const inside = (value, size) => Math.min(size - EDGE / 2, Math.max(EDGE / 2, value));
    return (point) => [
        inside(width / 2 + (point[0] - x) * scale, width),
        inside(height / 2 - (point[1] - y) * scale, height),
    ];
}

function name(context, text, points, width, height) {
    const x = points.reduce((sum, point) => sum + point[0], 0) / points.length;
    const y = points.reduce((sum, point) => sum + point[1], 0) / points.length;
    const half = context.measureText(text).width / 2;
    const at = Math.min(width - half - 2, Math.max(half + 2, x));
    const below = y < height / 2 ? y + 18 : y - 9;
    context.lineWidth = 3;
    context.strokeText(text, at, below);
    context.fillText(text, at, below);
}

/** `first` and `second`: names of the gestures that are nearest, or null. */
export function drawProjection(canvas, { gestures, templates, query }, first, second, paint) {
    const on = prepare(canvas);
    if (!on || !templates.length) return;
    const { context, width, height } = on;
    const place = placer(templates.map((template) => template.slice(1)), width, height);
    const groups = { other: [], second: [], first: [] };
    for (const [number, ...point] of templates) {
        const gesture = gestures[number];
        const kind = gesture === first ? "first" : gesture === second ? "second" : "other";
        groups[kind].push(place(point));
    }
    const look = { other: paint.line, second: paint.cut, first: paint.match };
    for (const [kind, points] of Object.entries(groups)) {
        context.fillStyle = context.strokeStyle = look[kind];
        context.lineWidth = 1.5;
        for (const [x, y] of points) MARKS[kind](context, x, y);
    }
    context.font = FONT;
    context.textAlign = "center";
    context.lineJoin = "round";
    for (const [kind, text] of [["second", second], ["first", first]]) {
        if (!text || !groups[kind].length) continue;
        context.fillStyle = look[kind];
        context.strokeStyle = paint.ground;
        name(context, text, groups[kind], width, height);
    }
    if (!query) return;
    context.strokeStyle = paint.text;
    context.lineWidth = 2;
    MARKS.you(context, ...place(query));
}
