"""What a frame's recognition looks like from inside, small enough to send ten times a second.

Only for who asks (the ``view`` message), and after the command is on its way.
"""

import base64
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.gateway.gallery import Enrolled
from app.pipeline import FrameResult, PcaMatcher
from app.pipeline.types import U8, Side

WIDTH = 160
"""Pixels of the masks."""
LINES = 64
"""Values of the histogram along the arm's axis."""
NEAREST = 5
"""Enrolled templates that are shown beside the hand."""
DRAWN = 80
"""Enrolled templates on the chart; more are thinned evenly."""


def detail(result: FrameResult, enrolled: Enrolled) -> dict[str, Any]:
    """``detail`` of the ``frame`` message: mask, template and distances."""
    template = result.template
    return {
        "mask": bit_png(_shrunk(result.mask)),
        "template": None if template is None else bit_png(template),
        "distances": {name: round(value, 4) for name, value in result.distances.items()},
        "threshold": _matcher(result, enrolled).max_distance,
        "wrist": None if result.wrist is None else result.wrist._asdict(),
    }


def glass(result: FrameResult, enrolled: Enrolled, settings: PipelineSettings) -> dict[str, Any]:
    """``detail.glass``: what lies between mask and answer."""
    mismatch, palm = result.mismatch, result.palm
    return {
        # Times 255: a changed pixel is still seen when four become one.
        "mismatch": None if mismatch is None else bit_png(_shrunk(mismatch * np.uint8(255))),
        "motion_limit": settings.motion.threshold,
        "wrist_mode": settings.wrist.mode,
        "palm": None
        if palm is None
        else {"x": palm.x, "y": palm.y, "radius": round(palm.radius, 1)},
        "histogram": None if palm is None else _histogram(result),
        "projection": _projection(result, _matcher(result, enrolled)),
        "nearest": _nearest(result, enrolled),
        "answer": _answer(result, settings),
    }


def bit_png(mask: NDArray[Any]) -> str:
    """A mask of 0 and 1 as a one-bit PNG in base64; 1 is white."""
    done, data = cv2.imencode(
        ".png", np.where(mask, np.uint8(255), np.uint8(0)), [cv2.IMWRITE_PNG_BILEVEL, 1]
    )
    assert done
    return base64.b64encode(data.tobytes()).decode("ascii")


def line_shares(mask: U8, side: Side) -> list[float]:
    """The white part of each line across the arm, in :data:`LINES` steps or fewer.

    From the top of the picture down, or from its left to its right: the histogram along the arm's
    axis in which the paper looks for the wrist.

    Args:
        mask: (h, w) of 0 and 1, hand with arm.
        side: Where the arm enters.
    """
    along_y = side in ("bottom", "top")
    shares = cv2.reduce(mask, 1 if along_y else 0, cv2.REDUCE_AVG, dtype=cv2.CV_32F).reshape(-1, 1)
    if len(shares) > LINES:
        shares = cv2.resize(shares, (1, LINES), interpolation=cv2.INTER_AREA).reshape(-1, 1)
    return [round(float(share), 3) for share in shares[:, 0]]


def _shrunk(mask: U8) -> U8:
    height, width = mask.shape
    size = (WIDTH, max(1, round(WIDTH * height / width)))
    return np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_AREA), np.uint8)


def _matcher(result: FrameResult, enrolled: Enrolled) -> PcaMatcher:
    """What the frame was matched by."""
    return enrolled.matcher.best if result.by_landmarks else enrolled.matcher


def _histogram(result: FrameResult) -> dict[str, Any]:
    side: Side = "bottom" if result.wrist is None else result.wrist.side
    axis = "y" if side in ("bottom", "top") else "x"
    return {"axis": axis, "shares": line_shares(result.mask, side)}


def _projection(result: FrameResult, matcher: PcaMatcher) -> dict[str, Any]:
    chart = matcher.chart
    count = len(matcher.templates)
    drawn = np.unique(np.linspace(0, max(count - 1, 0), min(count, DRAWN)).astype(np.intp))
    number = {label: n for n, label in enumerate(matcher.labels)}
    query: list[float] | None = None
    if result.look is not None:
        # The last coordinate is the reconstruction error, no component.
        components = [*result.look.point[:-1].tolist(), 0.0, 0.0]
        query = [round(value, 2) for value in components[:2]]
    return {
        "gestures": list(matcher.labels),
        "templates": [
            [number[matcher.templates[i][0]], *(round(float(v), 2) for v in chart.at[i])]
            for i in drawn
        ],
        "query": query,
        "share": [round(float(share), 4) for share in chart.share],
    }


def _nearest(result: FrameResult, enrolled: Enrolled) -> list[dict[str, Any]]:
    if result.look is None:
        return []
    distances = result.look.distances
    ids = enrolled.ids
    found = []
    for i in np.argsort(distances, kind="stable")[:NEAREST]:
        gesture, sample = _matcher(result, enrolled).templates[i]
        found.append(
            {
                "id": ids.get(gesture),
                "gesture": gesture,
                "sample": sample,
                "distance": round(float(distances[i]), 4),
            }
        )
    return found


def _answer(result: FrameResult, settings: PipelineSettings) -> dict[str, Any] | None:
    match, look = result.match, result.look
    if match is None or look is None:
        return None
    return {
        "gesture": match.gesture,
        "accepted": match.accepted,
        "distance": round(match.distance, 4),
        "second": look.second,
        "margin": None if match.margin is None else round(match.margin, 4),
        "min_margin": settings.match.min_margin,
        "error": round(match.error, 4),
        "max_error": settings.match.max_error,
    }
