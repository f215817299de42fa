"""Wrist crop: the arm is cut off, from whichever side it enters."""

import cv2
import numpy as np

from app.config import WristSettings
from app.pipeline.palm import Palm
from app.pipeline.types import U8, Side, WristCut


def cut_at(palm: Palm, radii: float) -> WristCut | None:
    """A cut ``radii`` palm radii from the palm's centre towards the arm; None without an arm."""
    if palm.arm is None:
        return None
    height, width = palm.piece.shape
    reach = radii * palm.radius
    if palm.arm == "bottom":
        return WristCut("bottom", min(height, int(palm.y + reach) + 1))
    if palm.arm == "top":
        return WristCut("top", max(0, int(palm.y - reach)))
    if palm.arm == "left":
        return WristCut("left", max(0, int(palm.x - reach)))
    return WristCut("right", min(width, int(palm.x + reach) + 1))


def erase_arm(mask: U8, cut: WristCut | None) -> None:
    """Set everything beyond the cut to 0, in place."""
    if cut is None:
        return
    if cut.side == "bottom":
        mask[cut.at :] = 0
    elif cut.side == "top":
        mask[: cut.at] = 0
    elif cut.side == "left":
        mask[:, : cut.at] = 0
    else:
        mask[:, cut.at :] = 0


def _histogram_cut(piece: U8, side: Side) -> WristCut:
    """The paper's cut: the minimum of the histogram between its maximum and the arm's side."""
    along_y = side in ("bottom", "top")
    counts = cv2.reduce(piece, 1 if along_y else 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S).ravel()
    if side in ("bottom", "right"):
        palm = int(np.argmax(counts))
        return WristCut(side, palm + int(np.argmin(counts[palm:])))
    # Turned round, so that of equal lines the one nearest the palm is taken on every side.
    counts = counts[::-1]
    palm = int(np.argmax(counts))
    wrist = palm + int(np.argmin(counts[palm:]))
    return WristCut(side, len(counts) - wrist)


class WristCrop:
    """Cut the arm off where the wrist is.

    ``histogram`` (paper): white pixels are counted line by line along the arm's axis; the maximum
    is the palm, the minimum beyond it, towards the arm, is the wrist.

    ``circle``: the palm is the largest inscribed circle, and the cut lies a number of its radii
    from its centre. On photographs the histogram's minimum wanders with the arm's angle and
    sleeve; benchmarks/RESULTS.md has both figures.
    """

    def __init__(self, settings: WristSettings) -> None:
        self._settings = settings
        self._hand: U8 = np.empty(0, np.uint8)

    def __call__(self, palm: Palm) -> tuple[U8, WristCut | None]:
        """Cut one hand.

        Returns:
            (h, w) hand without arm, a buffer that the next call overwrites, and the cut; None when
            the hand does not touch the picture's border, so that there is no arm to cut.
        """
        if self._hand.shape != palm.piece.shape:
            self._hand = np.empty(palm.piece.shape, np.uint8)
        np.copyto(self._hand, palm.piece)
        cut: WristCut | None = None
        if palm.arm is not None and self._settings.mode == "histogram":
            cut = _histogram_cut(palm.piece, palm.arm)
        elif self._settings.mode == "circle":
            cut = cut_at(palm, self._settings.radii)
        erase_arm(self._hand, cut)
        return self._hand, cut
