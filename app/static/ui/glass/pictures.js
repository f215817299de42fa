// The steps that are pictures: mask, motion, wrist, region, template. Drawn as the camera sees
// them; the page mirrors the canvases, as it does the operator's own picture.

import { prepare } from "./canvas.js";

const DIM = 0.35;

function bits(context, bitmap, width, height, alpha = 1) {
    context.globalAlpha = alpha;
    context.drawImage(bitmap, 0, 0, width, height);
    context.globalAlpha = 1;
}

export function drawMask(canvas, { mask }) {
    const on = prepare(canvas);
    if (on && mask) bits(on.context, mask, on.width, on.height);
}

/** What changed is bright, the hand behind it dim. */
export function drawMotion(canvas, { mask, mismatch }, paint) {
    const on = prepare(canvas);
    if (!on) return;
    const { context, width, height } = on;
    if (mismatch) {
        // The bits' white becomes the colour; black stays black, and adds nothing to the hand.
        bits(context, mismatch, width, height);
        context.globalCompositeOperation = "multiply";
        context.fillStyle = paint.cut;
        context.fillRect(0, 0, width, height);
    }
    context.globalCompositeOperation = "lighter";
    if (mask) bits(context, mask, width, height, DIM);
    context.globalCompositeOperation = "source-over";
}

function drawCurve(context, { axis, shares }, width, height, paint) {
    const along = axis === "y" ? height : width;
    const across = axis === "y" ? width : height;
    const most = Math.max(...shares, 1e-6);
    const at = (index) => {
        const place = ((index + 0.5) / shares.length) * along;
        const value = (shares[index] / most) * across * 0.5;
        return axis === "y" ? [value, place] : [place, across - value];
    };
    context.beginPath();
    shares.forEach((_, index) => context.lineTo(...at(index)));
    context.strokeStyle = paint.curve;
    context.lineWidth = 2;
    context.lineJoin = "round";
    context.stroke();
    context.lineTo(...(axis === "y" ? [0, height] : [width, height]));
    context.lineTo(...(axis === "y" ? [0, 0] : [0, height]));
    context.globalAlpha = 0.25;
    context.fillStyle = paint.curve;
    context.fill();
    context.globalAlpha = 1;
}

/** `frame`: {width, height} of the picture in whose pixels palm and cut are. */
export function drawWrist(canvas, { mask, histogram, palm, wrist }, frame, paint) {
    const on = prepare(canvas);
    if (!on) return;
    const { context, width, height } = on;
    if (mask) bits(context, mask, width, height, DIM);
    if (histogram) drawCurve(context, histogram, width, height, paint);
    const scale = { x: width / frame.width, y: height / frame.height };
    context.lineWidth = 1.5;
    if (palm) {
        context.strokeStyle = paint.text;
        context.beginPath();
        context.arc(palm.x * scale.x, palm.y * scale.y, palm.radius * scale.x, 0, 2 * Math.PI);
        context.stroke();
    }
    if (wrist) {
        const upright = wrist.side === "bottom" || wrist.side === "top";
        const at = wrist.at * (upright ? scale.y : scale.x);
        context.strokeStyle = paint.cut;
        context.lineWidth = 2;
        context.setLineDash([6, 4]);
        context.beginPath();
        if (upright) {
            context.moveTo(0, at);
            context.lineTo(width, at);
        } else {
            context.moveTo(at, 0);
            context.lineTo(at, height);
        }
        context.stroke();
        context.setLineDash([]);
    }
}

/** The hand in its box; what lies outside of it is dim. */
export function drawRegion(canvas, { mask, roi }, frame, paint) {
    const on = prepare(canvas);
    if (!on || !mask) return;
    const { context, width, height } = on;
    bits(context, mask, width, height, roi ? DIM : 1);
    if (!roi) return;
    const [x, y, w, h] = roi;
    const box = [
        (x * width) / frame.width,
        (y * height) / frame.height,
        (w * width) / frame.width,
        (h * height) / frame.height,
    ];
    context.save();
    context.beginPath();
    context.rect(...box);
    context.clip();
    bits(context, mask, width, height);
    context.restore();
    context.strokeStyle = paint.match;
    context.lineWidth = 2;
    context.strokeRect(...box);
}

export function drawTemplate(canvas, { template }) {
    const on = prepare(canvas);
    if (!on || !template) return;
    const { context, width, height } = on;
    const across = (height * template.width) / template.height;
    context.imageSmoothingEnabled = false;
    context.drawImage(template, (width - across) / 2, 0, across, height);
}
