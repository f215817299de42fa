"""Choose: which way to the mask suits a picture, and why."""

from typing import Literal

import cv2
import numpy as np
from cv2.typing import MatLike

from app.config import BinariseSettings
from app.pipeline.types import U8, Way

_THUMB = (40, 30)
_RING = 2
LIGHT, COLOUR = 40, 8
"""Levels of luminance and of either chroma that cells of one plain background differ by at most."""
PLAIN, ROOM = 0.88, 0.8
"""Part of the rim, without the arm's side, that has to be of one colour to begin, and to stay, with
the threshold. Of the digit photographs 98% reach the first, of whole webcam frames 3%."""
AGREE = 0.65
"""Overlap (intersection over union) with the network's mask from which a threshold is trusted: on
plain backgrounds all photographs have more than 0.84, in rooms half have less than this."""
PROVE_EVERY, DOUBT = 30, 60
"""Frames after which a threshold is proved again, and for which one that failed is not tried."""
ALIKE = 1.5
"""A proof holds for pieces of the proved one's area, within this factor either way. Once the hand
has left a wall that is darker to one side, the threshold splits the wall: a large new piece."""
PATIENCE = 5
"""Frames in a row that have to speak for the other way before it is taken: the two masks differ a
little, and going to and fro would look like motion."""


class Choose:
    """Plain or not is told from the rim of a thumbnail, and proved by the network now and then.

    A plain wall may still have a face before it, or nothing at all: so the first mask by threshold,
    every thirtieth after it, and each that is unlike the proved one (:meth:`found`) is held against
    the network's (:meth:`prove`).
    """

    def __init__(self, settings: BinariseSettings) -> None:
        self._fixed = settings.mode
        self._now: Literal["threshold", "learned"] | None = None
        self._against = 0
        self._proof_in = 0
        self._doubt = 0
        self._last = Way("learned", "")
        self._found = self._proved = 0

    def __call__(self, pixels: U8, *, held: bool = False) -> Way:
        """Choose for a (h, w, 3) BGR or (h, w, 1) grey picture, the next of a stream.

        Args:
            pixels: The picture.
            held: A gesture is held: the network's way is then not left for the threshold, whose
                mask of the same hand may be another gesture's, or none's.
        """
        if self._fixed != "auto":
            return Way(self._fixed, "the settings say so")
        if not (held and self._last.mode == "learned"):
            self._last = self._change(pixels)
        return self._last

    def _change(self, pixels: U8) -> Way:
        if self._doubt > 0:
            self._doubt -= 1
            return Way("learned", "the background is plain, but the threshold finds other things")
        plain = plain_part(pixels)
        verdict: Literal["threshold", "learned"]
        verdict = (
            "threshold" if plain >= (PLAIN if self._now != "threshold" else ROOM) else "learned"
        )
        if self._now is None:
            self._now = verdict
        self._against = self._against + 1 if verdict != self._now else 0
        if self._against >= PATIENCE:
            self._now, self._against = verdict, 0
        if self._now == "threshold":
            self._proof_in -= 1
            return Way("threshold", "the background is plain")
        if verdict == "threshold":
            return Way("learned", "the background has been plain for a moment only")
        return Way("learned", "the background is not plain")

    def found(self, area: int) -> None:
        """The threshold found a piece of so many pixels; 0: none that may be a hand."""
        self._found = area
        if not self._proved <= area * ALIKE <= self._proved * ALIKE**2:
            self._proof_in = -1

    @property
    def unproved(self) -> bool:
        """Whether the mask by threshold, just chosen, is to be held against the network's."""
        return self._fixed == "auto" and self._proof_in < 0

    def prove(self, threshold: U8, learned: U8) -> Way | None:
        """Hold two masks of the same hand against each other.

        Returns:
            None when they agree, else the way to take instead.
        """
        both = cv2.countNonZero(cv2.bitwise_and(threshold, learned))
        either = cv2.countNonZero(cv2.bitwise_or(threshold, learned))
        if either and both / either >= AGREE:
            self._proof_in = PROVE_EVERY
            self._proved = self._found
            return None
        self._now, self._against, self._doubt = "learned", 0, DOUBT
        self._last = Way("learned", "the background is plain, but the threshold finds other things")
        return self._last


def plain_part(pixels: U8) -> float:
    """Part of the picture's rim, 0 to 1, that has one colour; the arm's side is left out."""
    thumb = cv2.resize(pixels, _THUMB, interpolation=cv2.INTER_AREA)
    if thumb.ndim == 2:
        thumb = cv2.cvtColor(thumb, cv2.COLOR_GRAY2BGR)
    cells = cv2.cvtColor(thumb, cv2.COLOR_BGR2YCrCb)
    sides = [side.reshape(-1, 3).astype(np.int16) for side in _sides(cells)]
    best = 0.0
    for arm in range(len(sides)):
        rest = np.concatenate([side for index, side in enumerate(sides) if index != arm])
        far = np.abs(rest - np.median(rest, axis=0)) > (LIGHT, COLOUR, COLOUR)
        best = max(best, float(1 - far.any(axis=1).mean()))
    return best


def _sides(cells: MatLike) -> tuple[MatLike, MatLike, MatLike, MatLike]:
    r = _RING
    return cells[:r], cells[-r:], cells[r:-r, :r], cells[r:-r, -r:]
