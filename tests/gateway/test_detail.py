import numpy as np
import pytest

from app.gateway.detail import LINES, line_shares


@pytest.mark.parametrize(
    ("side", "middle"), [("bottom", 0.25), ("top", 0.25), ("left", 0.75), ("right", 0.75)]
)
def test_the_histogram_counts_lines_across_the_arm(side: str, middle: float) -> None:
    mask = np.zeros((240, 320), np.uint8)
    mask[40:80, 200:280] = 1
    shares = line_shares(mask, side)  # type: ignore[arg-type]
    assert len(shares) == LINES
    fullest = np.flatnonzero(np.array(shares) > 0.9 * max(shares))
    assert fullest.mean() / LINES == pytest.approx(middle, abs=0.02)
    assert np.mean(shares) == pytest.approx(mask.mean(), abs=1e-3)
    assert max(shares) == pytest.approx(
        80 / 320 if side in ("bottom", "top") else 40 / 240, abs=1e-3
    )


def test_a_small_picture_has_a_value_a_line() -> None:
    assert line_shares(np.ones((30, 40), np.uint8), "bottom") == [1.0] * 30
