"""Views: one hand turned a little and cut at several wrists, so that both may differ a little.

Every enrolled template and every query is varied, and the nearest pair of views counts. What that
gives is in docs/recognition.md.
"""

import math

import cv2
import numpy as np

from app.config import MatchSettings
from app.pipeline.palm import Palm, PalmFinder
from app.pipeline.template import HEIGHT, WIDTH, resize_mask
from app.pipeline.types import U8, WristCut
from app.pipeline.wrist import cut_at, erase_arm

SMALL = 80
"""Pixels. The hand is scaled so that its longer side has so many before it is turned: twice what
the features resolve."""
_CANVAS = math.ceil(SMALL * math.sqrt(2)) + 2
"""Pixels. Holds the small hand at any turn."""


class Views:
    """A hand as (v, h, w) masks, one for each cut and turn; an enrolled one leans, too.

    Each view: cut ``c`` palm radii from the palm's centre towards the arm, turned about the box's
    centre by ``a``, boxed again, and stretched to ``w`` x ``h``. That is 30x40 for the ``distance``
    features, whose smooth transform carries no more detail, and 60x80 for ``binary``.
    """

    def __init__(self, settings: MatchSettings) -> None:
        self._cuts = sorted(set(settings.cuts))
        self._trims = sorted(set(settings.trims), reverse=True)
        self._poses = [(turn, 0.0) for turn in settings.turns]
        # A hand seen a little from the side, or with its fingers leaning; enrolled ones only.
        self._enrolled = self._poses + [(0.0, shear) for shear in settings.shears]
        half = settings.features != "binary"
        self.width, self.height = (WIDTH // 2, HEIGHT // 2) if half else (WIDTH, HEIGHT)
        self._canvas: U8 = np.zeros((_CANVAS, _CANVAS), np.uint8)
        self._find_palm = PalmFinder(towards_fingers=False)

    def of_template(self, template: U8) -> U8:
        """Views of an (80, 60) template, whose flattest side is taken for the wrist."""
        template = np.ascontiguousarray(template, np.uint8)
        # All of it: a thumb may hang on a part of the hand that was cut off with the arm.
        palm = self._find_palm(template)._replace(piece=template)
        cuts = [_trimmed(palm, radii) for radii in self._trims]
        return self._vary(palm, cuts, self._enrolled)

    def __call__(self, palm: Palm) -> U8:
        """Views of the hand in ``palm.piece``; at least one."""
        return self._vary(palm, [cut_at(palm, radii) for radii in self._cuts], self._poses)

    def _vary(
        self, palm: Palm, cuts: list[WristCut | None], poses: list[tuple[float, float]]
    ) -> U8:
        if not palm.found:
            return np.zeros((1, self.height, self.width), np.uint8)
        cuts = cuts or [None]
        views = np.empty((len(cuts) * len(poses), self.height, self.width), np.uint8)
        count = 0
        seen: set[int | None] = set()
        # Shrinking comes first and once, with the longest piece of arm that any view keeps.
        hand = palm.piece.copy() if cuts[-1] is not None else palm.piece
        erase_arm(hand, cuts[-1])
        x, y, width, height = cv2.boundingRect(hand)
        scale = SMALL / max(width, height)
        # 0 and 255 from here on, so that resizing keeps what lies between.
        small = resize_mask(
            hand[y : y + height, x : x + width],
            max(1, round(width * scale)),
            max(1, round(height * scale)),
        ) * np.uint8(255)
        for cut in reversed(cuts):
            at: int | None = None
            if cut is not None:
                along_y = cut.side in ("bottom", "top")
                at = round((cut.at - (y if along_y else x)) * scale)
                at = min(max(at, 0), small.shape[0 if along_y else 1])
                erase_arm(small, cut._replace(at=at))
            if at not in seen:
                seen.add(at)
                for turn, shear in poses:
                    self._posed(small, turn, shear, views[count])
                    count += 1
        return views[:count]

    def _posed(self, small: U8, turn: float, shear: float, out: U8) -> None:
        if turn == 0 and shear == 0:
            turned = small
        else:
            height, width = small.shape
            cosine, sine = math.cos(turn), math.sin(turn)
            cx, cy, middle = (width - 1) / 2, (height - 1) / 2, (_CANVAS - 1) / 2
            # x' = R (x + shear y), about the middle
            linear = np.array([[cosine, cosine * shear - sine], [sine, sine * shear + cosine]])
            shift = middle - linear @ np.array([cx, cy])
            matrix = np.column_stack([linear, shift])
            cv2.warpAffine(
                small, matrix, (_CANVAS, _CANVAS), dst=self._canvas, flags=cv2.INTER_NEAREST
            )
            turned = self._canvas
        x, y, width, height = cv2.boundingRect(turned)
        if width == 0 or height == 0:
            out.fill(0)
            return
        box = turned[y : y + height, x : x + width]
        cv2.resize(box, (self.width, self.height), dst=out, interpolation=cv2.INTER_AREA)
        cv2.threshold(out, 127, 1, cv2.THRESH_BINARY, dst=out)


def _trimmed(palm: Palm, radii: float) -> WristCut | None:
    """A cut so many palm radii inwards from the side where a template's wrist is."""
    if palm.arm is None:
        return None
    height, width = palm.piece.shape
    inwards = round(radii * palm.radius)
    at = {"bottom": height - inwards, "top": inwards, "left": inwards, "right": width - inwards}
    return WristCut(palm.arm, at[palm.arm])
