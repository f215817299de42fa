"""Binarise, palm, motion, ROI, wrist and template on drawn masks."""

import cv2
import numpy as np
import pytest

from app.config import BinariseSettings, MotionSettings, RoiSettings, WristSettings
from app.errors import Invalid
from app.pipeline import WristCut, pack_template, unpack_template
from app.pipeline.binarise import Binarise, otsu
from app.pipeline.motion import MotionGate
from app.pipeline.normalise import Normalised
from app.pipeline.palm import PalmFinder
from app.pipeline.roi import RegionOfInterest
from app.pipeline.template import MakeTemplate
from app.pipeline.wrist import WristCrop
from tests.pipeline.drawing import draw_mask

SIDES = ("bottom", "left", "top", "right")
MASK = draw_mask("two", size=(320, 240))


def two_colours(mask, hand, wall):
    return Normalised.of(np.where(mask == 1, hand, wall).astype(np.uint8))


@pytest.mark.parametrize(("hand", "wall"), [(200, 60), (60, 200)])
def test_hand_is_one_light_on_dark_and_dark_on_light(hand, wall):
    binary = Binarise(BinariseSettings())(two_colours(MASK, hand, wall))
    assert np.array_equal(binary.mask, MASK)
    assert binary.contrast == pytest.approx(140, abs=0.5)
    assert binary.light is (hand > wall)


@pytest.mark.parametrize(("polarity", "same"), [("light", True), ("dark", False)])
def test_polarity_can_be_fixed(polarity, same):
    binary = Binarise(BinariseSettings(polarity=polarity))(two_colours(MASK, 200, 60))
    assert np.array_equal(binary.mask, MASK) is same


def test_low_contrast_is_no_hand():
    plane = two_colours(MASK, 255, 0).plane
    binary = Binarise(BinariseSettings(min_contrast=5))(Normalised.of(plane, 100, 103))
    assert binary.contrast == pytest.approx(3)
    assert not binary.mask.any()


def test_threshold_is_the_one_of_opencv():
    plane = np.random.default_rng(0).normal(90, 25, (100, 100))
    plane[:40] += 90
    plane = plane.clip(0, 255).astype(np.uint8)
    expected, _ = cv2.threshold(plane, 0, 1, cv2.THRESH_OTSU)
    level, difference = otsu(Normalised.of(plane).counts)
    assert level == expected
    assert difference == pytest.approx(plane[plane > level].mean() - plane[plane <= level].mean())


def test_flat_plane_is_no_hand():
    flat = np.full((50, 50), 9, np.uint8)
    assert not Binarise(BinariseSettings(min_contrast=0))(Normalised.of(flat, 9, 9)).mask.any()


@pytest.mark.parametrize("side", SIDES)
def test_palm_and_arm_are_found_from_every_side(side):
    palm = PalmFinder()(draw_mask("two", size=(320, 240), side=side))
    assert palm.found
    assert palm.arm == side
    assert palm.radius == pytest.approx(35, abs=4)


def test_other_pieces_are_dropped():
    specked = MASK.copy()
    specked[5:12, 5:12] = 1
    palm = PalmFinder()(specked)
    assert np.array_equal(palm.piece, MASK)
    assert palm.area == MASK.sum()


@pytest.mark.parametrize("mask", [np.zeros((40, 60), np.uint8), np.ones((40, 60), np.uint8)])
def test_empty_and_full_masks_are_survived(mask):
    assert PalmFinder()(mask).found is bool(mask.any())


def two_circles(upper: int, lower: int) -> np.ndarray:
    """(240, 320) two discs of these radii, one above the other, on an arm from below."""
    mask = np.zeros((240, 320), np.uint8)
    cv2.rectangle(mask, (140, 90), (180, 239), 1, -1)
    cv2.circle(mask, (160, 70), upper, 1, -1)
    cv2.circle(mask, (160, 160), lower, 1, -1)
    return mask


def test_of_two_circles_almost_as_large_the_one_at_the_fingers_is_the_palm():
    assert PalmFinder()(two_circles(49, 50)).y == pytest.approx(70, abs=3)
    assert PalmFinder()(two_circles(40, 50)).y == pytest.approx(160, abs=3)
    assert PalmFinder(towards_fingers=False)(two_circles(49, 50)).y == pytest.approx(160, abs=3)


def test_the_palm_at_the_fingers_is_kept_while_it_is_nearly_as_large():
    find = PalmFinder()
    places = [find(two_circles(upper, 50)).y for upper in (50, 46, 50, 46, 40, 46)]
    # Once it is much smaller it is given up, and does not come back before it is almost as large.
    assert places == pytest.approx([70, 70, 70, 70, 160, 160], abs=3)


def test_hand_without_arm_has_no_side():
    mask = np.zeros((100, 100), np.uint8)
    mask[30:70, 30:70] = 1
    palm = PalmFinder()(mask)
    assert palm.arm is None
    hand, cut = WristCrop(WristSettings())(palm)
    assert cut is None
    assert np.array_equal(hand, mask)


@pytest.mark.parametrize("mode", ["circle", "histogram"])
@pytest.mark.parametrize("side", SIDES)
def test_wrist_is_cut_on_every_side_alike(mode, side):
    size = (240, 240)
    bottom = WristCrop(WristSettings(mode=mode))(PalmFinder()(draw_mask("five", size=size)))
    hand, cut = WristCrop(WristSettings(mode=mode))(
        PalmFinder()(draw_mask("five", size=size, side=side))
    )
    assert cut is not None
    assert cut.side == side
    assert int(hand.sum()) == pytest.approx(int(bottom[0].sum()), rel=0.03)
    assert 0.3 < hand.sum() / draw_mask("five", size=size).sum() < 0.95


def test_histogram_cuts_at_the_narrowest_line_below_the_palm():
    mask = np.zeros((100, 100), np.uint8)
    mask[10:50, 20:80] = 1
    mask[50:60, 40:60] = 1
    mask[55, 45:55] = 1
    mask[55, :45] = mask[55, 55:] = 0
    mask[60:, 30:70] = 1
    _, cut = WristCrop(WristSettings(mode="histogram"))(PalmFinder()(mask))
    assert cut == WristCut("bottom", 55)


def test_wrist_can_be_left_alone():
    hand, cut = WristCrop(WristSettings(mode="off"))(PalmFinder()(MASK))
    assert cut is None
    assert np.array_equal(hand, MASK)


def test_gate_is_the_papers_formula():
    rng = np.random.default_rng(0)
    f1, f2, f3 = (rng.integers(0, 2, (40, 50)).astype(np.uint8) for _ in range(3))
    gate = MotionGate(MotionSettings())
    assert gate(f1, 0.0).fraction is None
    assert gate(f2, 0.1).fraction is None
    motion = gate(f3, 0.2)
    assert motion.fraction == (((f1 ^ f3) | (f2 ^ f3)).sum() / f1.size)
    assert not motion.still


@pytest.mark.parametrize(("changed", "still"), [(99, True), (100, False)])
def test_still_means_fewer_than_one_percent(changed, still):
    gate = MotionGate(MotionSettings())
    mask = np.zeros((100, 100), np.uint8)
    gate(mask, 0.0)
    gate(mask, 0.1)
    moved = mask.copy()
    moved.flat[:changed] = 1
    motion = gate(moved, 0.2)
    assert motion.fraction == changed / 10_000
    assert motion.still is still
    assert motion.nearly_still


def test_frames_between_samples_leave_the_answer():
    gate = MotionGate(MotionSettings(interval_s=0.1))
    zeros, ones = np.zeros((10, 10), np.uint8), np.ones((10, 10), np.uint8)
    for now in (0.0, 0.1, 0.2):
        motion = gate(zeros, now)
    assert motion.still
    assert gate(ones, 0.25).still
    assert not gate(ones, 0.31).still


@pytest.mark.parametrize("restart", ["reset", "shape"])
def test_gate_waits_again(restart):
    gate = MotionGate(MotionSettings())
    for now in range(3):
        gate(MASK, now)
    if restart == "reset":
        gate.reset()
    mask = MASK if restart == "reset" else MASK[:100].copy()
    assert gate(mask, 9.0).fraction is None


def test_roi_follows_the_offsets():
    mask = np.zeros((100, 200), np.uint8)
    mask[20:60, 50:90] = 1
    mask[5, 50:52] = 1  # 2 of 200 in a row do not exceed 1%
    mask[70:72, 120] = 1  # 2 of 100 in a column do; in their rows they do not
    assert RegionOfInterest(RoiSettings())(mask) == (50, 20, 71, 40)


def test_roi_without_offset_is_the_bounding_box():
    assert RegionOfInterest(RoiSettings(offset=0))(np.eye(30, 40, dtype=np.uint8)) == (0, 0, 30, 30)


def test_roi_of_nothing_is_none():
    assert RegionOfInterest(RoiSettings())(np.zeros((30, 40), np.uint8)) is None


def test_template_is_60_wide_and_80_high():
    template = MakeTemplate()(MASK, (100, 40, 120, 160))
    assert template.shape == (80, 60)
    assert template.dtype == np.uint8
    assert set(np.unique(template)) == {0, 1}


def test_pack_and_unpack():
    template = np.random.default_rng(0).integers(0, 2, (80, 60)).astype(np.uint8)
    packed = pack_template(template)
    assert len(packed) == 600
    assert packed[0] >> 7 == template[0, 0]
    assert np.array_equal(unpack_template(packed), template)


def test_wrong_sizes_are_refused():
    with pytest.raises(Invalid, match=r"^a template is 80 rows of 60 pixels, not \(60, 80\)$"):
        pack_template(np.zeros((60, 80), np.uint8))
    with pytest.raises(Invalid, match=r"^a packed template has 600 bytes, not 3$"):
        unpack_template(b"abc")
