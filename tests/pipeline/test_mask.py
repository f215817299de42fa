"""The learned mask, on drawn hands before drawn rooms and faces."""

from functools import cache

import cv2
import numpy as np
import pytest

from app.gestures.hand import POSES, TONES, HandLook, HandView, render_sprite
from app.gestures.hand.render import compose
from app.pipeline.mask import AGAIN, MOST_SKIPPED, LearnedMask, Masked
from app.pipeline.network import load

SIZE = (320, 240)
SEEN = ("stop", "forward", "up", "close")
"""An open hand, a V, one finger, a fist."""


@cache
def room(seed: int = 1) -> np.ndarray:
    """(240, 320, 3) BGR float: a wall with light from a side, furniture, a person with a face."""
    rng = np.random.default_rng(seed)
    width, height = SIZE
    light = np.linspace(0.75, 1.1, width)[None, :, None]
    picture = np.float32(rng.uniform(110, 190, 3)) * np.ones((height, width, 1)) * light
    picture = np.ascontiguousarray(picture, np.float32)
    for _ in range(6):
        x, y = (int(v) for v in rng.integers(0, (width, height)))
        w, h = (int(v) for v in rng.integers(15, 110, 2))
        colour = tuple(float(v) for v in rng.uniform(20, 230, 3))
        cv2.rectangle(picture, (x, y), (x + w, y + h), colour, -1)
    face = 265, 80
    cv2.ellipse(picture, (face[0], 235), (55, 90), 0, 0, 360, (110.0, 70.0, 50.0), -1)
    cv2.ellipse(picture, (face[0], face[1] - 10), (34, 44), 0, 0, 360, (30.0, 35.0, 45.0), -1)
    cv2.ellipse(picture, face, (28, 40), 0, 0, 360, (120.0, 155.0, 205.0), -1)
    for x in (-11, 11):
        cv2.ellipse(picture, (face[0] + x, face[1] - 6), (5, 3), 0, 0, 360, (40.0, 40.0, 50.0), -1)
    cv2.ellipse(picture, (face[0], face[1] + 20), (11, 3), 0, 0, 360, (90.0, 90.0, 160.0), -1)
    return cv2.GaussianBlur(picture, (0, 0), 0.8)


@cache
def scene(
    pose: str = "stop",
    tone: str = "medium",
    centre: tuple[float, float] = (130, 130),
    length: float = 150,
    noise: int = 2,
) -> tuple[np.ndarray, np.ndarray]:
    """A drawn hand in the drawn room: (240, 320, 3) BGR, and where the hand really is."""
    look = HandLook(skin=TONES[tone])
    sprite = render_sprite(POSES[pose], SIZE, HandView(length, centre), look)
    picture = compose(sprite, room())
    picture = picture + np.random.default_rng(noise).normal(0, 2, picture.shape)
    return picture.clip(0, 255).astype(np.uint8), (sprite.cover > 0.5).astype(np.uint8)


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """Intersection over union."""
    return float((a & b).sum() / max(1, (a | b).sum()))


def overlap_inside(found: Masked, truth: np.ndarray) -> float:
    """The same within the part looked at: the arm goes on outside of it."""
    x, y, width, height = found.bounds
    part = slice(y, y + height), slice(x, x + width)
    return overlap(found.mask[part], truth[part])


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("pose", SEEN)
def test_finds_the_hand_and_not_the_face(pose, tone):
    picture, truth = scene(pose, tone)
    found = LearnedMask()(picture)
    assert overlap(found.mask, truth) > 0.85
    assert found.mask[40:125, 235:295].mean() < 0.1
    assert 0.5 < found.sure <= 1.0


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_finds_a_hand_from_another_side(turns):
    picture, truth = (np.ascontiguousarray(np.rot90(x, turns)) for x in scene())
    assert overlap(LearnedMask()(picture).mask, truth) > 0.8


def test_a_room_without_a_hand_gives_none():
    empty = room().clip(0, 255).astype(np.uint8)
    found = LearnedMask()(empty)
    assert found.mask.mean() < 0.005


@pytest.mark.parametrize("level", [0, 128, 255])
def test_a_picture_of_one_colour_gives_none(level):
    found = LearnedMask()(np.full((240, 320, 3), level, np.uint8))
    assert not found.mask.any()
    assert found.sure == 0.0
    assert found.bounds == (0, 0, 320, 240)


def test_grey_pictures_work_as_well():
    picture, truth = scene()
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)[:, :, None]
    found = LearnedMask()(grey)
    assert found.mask.shape == grey.shape[:2]
    assert overlap(found.mask, truth) > 0.75


@pytest.mark.parametrize("size", [(16, 16), (900, 17), (17, 900), (641, 479), (100, 100)])
def test_any_size_gives_a_mask_of_that_size(size):
    width, height = size
    found = LearnedMask()(cv2.resize(scene()[0], (width, height)))
    assert found.mask.shape == (height, width)
    assert set(np.unique(found.mask)) <= {0, 1}


def test_a_small_hand_gets_a_second_look():
    near, _ = scene(length=230, centre=(150, 140))
    far, truth = scene(length=75, centre=(110, 150))
    find = LearnedMask()
    find(near)
    assert find.looks == 1
    find = LearnedMask()
    found = find(far)
    assert find.looks == 2
    assert found.bounds != (0, 0, *SIZE)
    assert overlap(found.mask, truth) > 0.75


def test_outside_of_the_part_looked_at_there_is_nothing():
    found = LearnedMask()(scene(length=75, centre=(110, 150))[0])
    x, y, width, height = found.bounds
    outside = found.mask.copy()
    outside[y : y + height, x : x + width] = 0
    assert not outside.any()


def test_an_unchanged_frame_takes_no_look_and_never_for_long():
    find = LearnedMask()
    first = find(scene()[0]).mask.copy()
    looks = []
    for number in range(2 * MOST_SKIPPED + 2):
        # The noise of a sensor is another in each frame.
        again = find(scene(noise=10 + number)[0])
        looks.append(find.looks)
        assert overlap(again.mask, first) > 0.95
    assert looks == ([0] * MOST_SKIPPED + [1]) * 2


def test_a_finger_that_moves_is_looked_at():
    find = LearnedMask()
    find(scene("stop")[0])
    found = find(scene("forward")[0])
    assert find.looks >= 1
    assert overlap(found.mask, scene("forward")[1]) > 0.75


def test_a_small_hand_is_followed_with_one_look_a_frame():
    find = LearnedMask()
    find(scene(length=75, centre=(90, 150))[0])
    for x in (96, 103, 110, 118):
        picture, truth = scene(length=75, centre=(x, 150))
        found = find(picture)
        assert find.looks == 1
        assert found.bounds != (0, 0, *SIZE)
        assert overlap_inside(found, truth) > 0.8


def test_what_is_followed_is_given_up_for_a_hand_that_comes_beside_it():
    """A small thing like a hand, alone in the picture at first, is not followed for ever."""
    find = LearnedMask()
    small, _ = scene(length=60, centre=(60, 60))
    find(small)
    find(scene(length=60, centre=(63, 60))[0])
    assert find.looks == 1
    hand, truth = scene(length=130, centre=(190, 150))
    both = small.copy()
    both[:, 125:] = hand[:, 125:]
    for number in range(AGAIN + MOST_SKIPPED + 1):
        # Both keep moving a little, so that each picture is looked at.
        found = find(np.roll(both, number % 2, axis=1))
    assert overlap_inside(found, truth) > 0.75


def test_the_part_leaves_out_the_arm_and_keeps_the_fingers():
    find = LearnedMask()
    picture, truth = scene(length=75, centre=(110, 110))
    _, y, _, height = find(picture).bounds
    assert not truth[:y].any()
    assert truth[y + height :].any()


@pytest.mark.parametrize("pose", SEEN)
def test_a_hand_at_rest_is_looked_at_as_a_photograph_of_it_is(pose):
    pictures = [scene(pose, length=75, centre=(110, 150), noise=noise)[0] for noise in range(8)]
    photograph = LearnedMask()(pictures[0])
    find = LearnedMask()
    for picture in pictures:
        # Each is looked at: the noise alone would let the last mask stand.
        find._thumb = np.empty(0, np.uint8)
        found = find(picture)
        assert found.bounds == photograph.bounds
    assert overlap(found.mask, photograph.mask) > 0.93


def test_a_part_that_cuts_fingers_off_grows():
    find = LearnedMask()
    picture, truth = scene(length=75, centre=(110, 150))
    find(picture)
    assert find._part is not None
    x, y, width, height = find._part
    top = int(np.flatnonzero(truth.any(axis=1))[0])
    short = top + 8
    find._part, find._full = (x, short, width, y + height - short), False
    find._thumb = np.empty(0, np.uint8)
    found = find(picture)
    assert found.bounds[1] <= top
    assert overlap_inside(found, truth) > 0.75


def test_a_hand_that_leaves_is_given_up_and_found_elsewhere():
    find = LearnedMask()
    find(scene(length=75, centre=(110, 150))[0])
    empty = find(room().clip(0, 255).astype(np.uint8))
    # The part, and then the whole picture.
    assert find.looks == 2
    assert empty.bounds == (0, 0, *SIZE)
    assert empty.mask.mean() < 0.005
    picture, truth = scene(length=75, centre=(60, 100))
    assert overlap_inside(find(picture), truth) > 0.75


def test_another_picture_size_begins_anew():
    find = LearnedMask()
    find(scene(length=75, centre=(110, 150))[0])
    small = cv2.resize(scene()[0], (160, 120), interpolation=cv2.INTER_AREA)
    assert find(small).mask.shape == (120, 160)


def test_two_masks_do_not_share_their_buffers():
    first, second = LearnedMask(), LearnedMask()
    kept = first(scene()[0])
    before = kept.mask.copy()
    second(room().clip(0, 255).astype(np.uint8))
    assert np.array_equal(kept.mask, before)


def test_both_looks_share_one_network():
    assert load("hand_mask.onnx") is load("hand_mask.onnx")
