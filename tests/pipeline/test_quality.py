import os

import cv2
import numpy as np
import pytest

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.gestures.hand import POSES
from app.pipeline import extract_template
from app.pipeline.palm import PalmFinder
from app.pipeline.quality import sharpness
from app.pipeline.still import take_shot
from tests.pipeline.drawing import PHOTOS
from tests.pipeline.shots import hand, jpeg, shaken, two_hands

SETTINGS = PipelineSettings()


def problem(picture, settings=SETTINGS) -> str | None:
    """The word for what is wrong with a picture."""
    try:
        take_shot(jpeg(picture), settings)
    except ImageRefused as error:
        assert error.message
        return error.detail["problem"]
    return None


@pytest.mark.parametrize("gesture", ["stop", "close", "left", "home"])
def test_a_good_picture_is_taken(gesture):
    shot = take_shot(jpeg(hand(gesture)), SETTINGS)
    assert shot.quality.problem is None
    assert shot.quality.advice == ()
    expected = extract_template(jpeg(hand(gesture)), SETTINGS).template
    assert np.array_equal(shot.extraction.template, expected)


@pytest.mark.parametrize("gesture", ["stop", "close", "left"])
@pytest.mark.parametrize(
    "spoil",
    [
        lambda picture: cv2.GaussianBlur(picture, (0, 0), 9),
        lambda picture: shaken(picture, 41),
        lambda picture: shaken(picture, 41, 90),
        lambda picture: shaken(picture, 49, 60),
    ],
    ids=["out of focus", "shaken sideways", "shaken upwards", "shaken aslant"],
)
def test_a_blurred_picture_is_refused(gesture, spoil):
    picture = spoil(hand(gesture))
    with pytest.raises(ImageRefused, match=r"^the picture is blurred \(sharpness 1\.[0-3]\d"):
        take_shot(jpeg(picture), SETTINGS)
    # Only where it is enrolled: an evaluation, and asking what a picture shows, take it.
    assert extract_template(jpeg(picture), SETTINGS).template.any()


def test_sharpness_depends_on_neither_contrast_nor_size():
    mask = np.zeros((480, 640), np.uint8)
    cv2.circle(mask, (320, 240), 80, 1, -1)
    noise = np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)
    picture = cv2.resize(noise, (640, 480), interpolation=cv2.INTER_NEAREST)
    found = sharpness(picture, PalmFinder()(mask))
    assert sharpness(picture // 4 + 90, PalmFinder()(mask)) == pytest.approx(found, rel=0.1)
    half = cv2.resize(picture, (320, 240), interpolation=cv2.INTER_AREA)
    assert sharpness(half, PalmFinder()(mask[::2, ::2])) == pytest.approx(found, rel=0.1)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)[:, :, None]
    assert sharpness(grey, PalmFinder()(mask)) == pytest.approx(found, rel=0.1)
    blurred = cv2.GaussianBlur(picture, (0, 0), 12)
    assert sharpness(blurred, PalmFinder()(mask)) < 0.7 * found


def test_two_hands_are_refused_and_one_beside_a_small_thing_is_not():
    assert problem(two_hands()) == "two_hands"
    picture = hand("stop", 220.0, (240.0, 240.0))
    picture[60:90, 560:590] = (120, 150, 210)
    assert problem(picture) is None


def test_a_hand_without_a_wrist_is_refused():
    assert problem(hand()[:320]) == "no_wrist"
    shot = take_shot(jpeg(hand()[:345]), PipelineSettings())
    assert [advice.code for advice in shot.quality.advice] == ["little_wrist"]


def test_a_hand_in_a_sleeve_still_has_a_wrist():
    picture = hand()
    # The arm ends above the picture's border, as where a sleeve begins.
    picture[430:] = picture[430:, :100].mean((0, 1))
    assert problem(picture) is None


def test_a_hand_that_is_cut_off_or_small_is_refused():
    assert problem(hand("stop", 330.0, (610.0, 260.0))) == "cut_off"
    strict = PipelineSettings.model_validate({"quality": {"min_palm": 60}})
    assert problem(hand(), strict) == "too_small"
    with pytest.raises(ImageRefused, match=r"palm is \d+ pixels wide, at least 120 are needed"):
        take_shot(jpeg(hand()), strict)


def test_an_empty_room_is_no_hand():
    assert problem(hand("stop", 270.0, (320.0, 2000.0))) == "no_hand"


def test_what_is_switched_off_refuses_nothing():
    lax = PipelineSettings.model_validate(
        {"quality": {"min_sharpness": 0, "min_palm": 0, "second_hand": 0}}
    )
    assert problem(two_hands(), lax) is None
    assert problem(cv2.GaussianBlur(hand(), (0, 0), 9), lax) is None


@pytest.mark.parametrize("gesture", POSES)
def test_no_starter_gesture_is_refused(gesture):
    for turn in (-0.2, 0.2):
        assert problem(hand(gesture, turn=turn)) is None


@pytest.mark.skipif(not PHOTOS.is_dir(), reason="no photographs beside the repository")
@pytest.mark.parametrize("kind", ["digits", "webcam-box"])
def test_good_photographs_are_taken_and_blurred_copies_are_not(kind):
    step = int(os.environ.get("FARHAND_PHOTO_STEP", "12"))
    refused, caught, count = 0, 0, 0
    for path in sorted((PHOTOS / kind).glob("*/*.jpg"))[::step]:
        picture = cv2.imread(str(path))
        count += 1
        refused += problem(picture) == "blurred"
        spread = 0.05 * max(picture.shape[:2]) * (0.8 if kind == "digits" else 0.6)
        caught += problem(cv2.GaussianBlur(picture, (0, 0), spread)) is not None
    assert refused <= 0.02 * count + 1
    assert caught >= 0.9 * count
