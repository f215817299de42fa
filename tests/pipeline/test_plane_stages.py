"""Channel, smooth and normalise: the stages that may run on an edge node."""

import tracemalloc

import cv2
import numpy as np
import pytest

from app.config import NormaliseSettings, SmoothSettings
from app.pipeline.channel import Channel
from app.pipeline.normalise import Normalise
from app.pipeline.smooth import BINOMIAL, Smooth
from tests.pipeline.drawing import draw

PICTURE = cv2.resize(draw("five"), (320, 240))
PLANE = np.random.default_rng(3).integers(40, 120, (240, 320)).astype(np.uint8)


def test_cr_is_higher_on_skin():
    plane = Channel("cr")(PICTURE)
    assert plane.shape == (240, 320)
    assert plane[132, 160] > plane[5, 5] + 15


def test_luminance_is_bt601():
    colour = np.full((16, 16, 3), (10, 100, 200), np.uint8)
    assert Channel("luminance")(colour)[0, 0] == round(0.114 * 10 + 0.587 * 100 + 0.299 * 200)


def test_picture_without_colour_falls_back_to_luminance():
    grey = cv2.cvtColor(PLANE, cv2.COLOR_GRAY2BGR)
    assert np.array_equal(Channel("cr")(grey), PLANE)


def test_grey_picture_is_its_own_plane():
    assert np.array_equal(Channel("cr")(PLANE[:, :, None]), PLANE)


@pytest.mark.parametrize("kernel", [3, 5, 7])
def test_smooth_is_the_integer_formula(kernel):
    weights = np.array(BINOMIAL[kernel])
    half = kernel // 2
    padded = np.pad(PLANE.astype(np.int64), half, mode="reflect")
    total = np.zeros(PLANE.shape, np.int64)
    for dy, wy in enumerate(weights):
        for dx, wx in enumerate(weights):
            total += wy * wx * padded[dy : dy + 240, dx : dx + 320]
    scale = int(weights.sum()) ** 2
    expected = (total + scale // 2) // scale
    assert np.array_equal(Smooth(SmoothSettings(kernel=kernel))(PLANE), expected)


def test_kernel_of_one_leaves_the_picture():
    assert np.array_equal(Smooth(SmoothSettings(kernel=1))(PLANE), PLANE)


def test_normalise_stretches_to_the_full_range():
    out = Normalise(NormaliseSettings(clip=0))(PLANE)
    assert (out.low, out.high) == (40, 119)
    expected = (PLANE.astype(int) - 40) * 255 // 79
    assert np.array_equal(out.plane, expected)
    assert np.array_equal(out.counts, np.bincount(out.plane.ravel(), minlength=256))


def test_normalise_ignores_single_hot_pixels():
    hot = PLANE.copy()
    hot[0, 0], hot[1, 1] = 255, 0
    out = Normalise(NormaliseSettings(clip=0.001))(hot)
    assert (out.low, out.high) == (40, 119)
    assert out.plane[0, 0] == 255
    assert out.plane[1, 1] == 0


def test_flat_picture_stays_flat():
    flat = np.full((20, 30), 77, np.uint8)
    out = Normalise(NormaliseSettings())(flat)
    assert np.array_equal(out.plane, flat)
    assert out.low == out.high


@pytest.mark.parametrize(
    "stage",
    [Channel("cr"), Channel("luminance"), Smooth(SmoothSettings()), Normalise(NormaliseSettings())],
    ids=["cr", "luminance", "smooth", "normalise"],
)
def test_nothing_of_a_frames_size_is_allocated(stage):
    source = PICTURE if isinstance(stage, Channel) else PLANE

    def plane():
        out = stage(source)
        return getattr(out, "plane", out)

    first = plane()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        assert np.shares_memory(plane(), first)
        assert tracemalloc.get_traced_memory()[1] - before < PLANE.size // 8
    finally:
        tracemalloc.stop()


def test_another_shape_is_taken_too():
    smooth = Smooth(SmoothSettings())
    smooth(PLANE)
    assert smooth(PLANE[:100, :50].copy()).shape == (100, 50)
