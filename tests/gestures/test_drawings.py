"""The drawings of the starter gestures."""

from pathlib import Path

import cv2
import numpy as np

from app.gestures.drawings import SIZE, drawings, write_drawings
from app.gestures.hand.poses import POSES

MEDIA = Path(__file__).parents[2] / "app" / "static" / "media" / "hands"


def test_the_shipped_drawings_are_what_is_drawn() -> None:
    """Draw them anew with ``farhand gestures draw-operator`` when this fails."""
    assert {path.stem for path in MEDIA.iterdir()} == set(POSES)
    for name, drawn in drawings():
        shown = cv2.imread(str(MEDIA / f"{name}.webp"))
        assert shown is not None
        assert shown.shape == (SIZE[1], SIZE[0], 3)
        assert np.abs(shown.astype(int) - drawn).mean() < 4, name


def test_a_hand_is_whole_and_its_arm_comes_from_below() -> None:
    for name, drawn in drawings():
        hand = np.abs(drawn.astype(int) - drawn[0, 0]).max(axis=2) > 24
        assert hand[-1].any(), name
        assert not hand[0].any() and not hand[:, 0].any() and not hand[:, -1].any(), name
        assert hand.mean() > 0.15, name


def test_drawings_are_written_whole_and_leave_nothing_else(tmp_path: Path) -> None:
    write_drawings(tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == sorted(f"{name}.webp" for name in POSES)
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < 12_000
