import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.gestures.hand import (
    POSES,
    RELAXED,
    TONES,
    Finger,
    HandLook,
    HandPose,
    HandView,
    blend,
    hand_mask,
    jitter,
    render_hand,
    render_sprite,
)
from app.gestures.hand.anatomy import FINGERS, THUMB_BONES
from app.gestures.hand.skeleton import THUMB, pose_skeleton

SMALL = (200, 160)
VIEW = HandView(100.0)


@pytest.mark.parametrize("name", POSES)
def test_the_mask_is_exactly_where_the_picture_differs_from_its_background(name: str) -> None:
    look = HandLook(background=(255, 0, 255), skin=TONES["brown"])
    picture = render_hand(POSES[name], SMALL, VIEW, look).astype(int)
    differs = np.abs(picture - look.background).sum(axis=2)
    mask = hand_mask(POSES[name], SMALL, VIEW).astype(bool)
    assert mask.dtype == bool
    assert differs[mask].min() > 100
    # Beside the hand only the outline's smoothed pixels show anything of it.
    cover = render_sprite(POSES[name], SMALL, VIEW, look).cover
    assert set(np.unique(mask)) == {False, True}
    np.testing.assert_array_equal(mask, cover >= 0.5)
    assert (differs[cover == 0] == 0).all()
    assert np.mean((cover > 0) & (cover < 1)) < 0.06


def test_the_same_arguments_give_the_same_picture() -> None:
    look = HandLook(noise=3.0, blur=0.5, gradient=0.2)
    one, same = (render_hand(POSES["up"], SMALL, VIEW, look, seed=7) for _ in range(2))
    np.testing.assert_array_equal(one, same)
    assert np.any(one != render_hand(POSES["up"], SMALL, VIEW, look, seed=8))


@pytest.mark.parametrize("name", POSES)
def test_a_left_hand_is_the_mirror_image(name: str) -> None:
    right = hand_mask(POSES[name], SMALL, VIEW)
    left = hand_mask(POSES[name], SMALL, HandView(100.0, left=True))
    assert np.mean(right[:, ::-1] != left) < 0.001


def test_the_thumb_of_a_right_hand_that_shows_its_palm_is_on_the_right() -> None:
    columns = np.nonzero(hand_mask(POSES["left"], SMALL, VIEW).any(axis=0))[0]
    assert columns.max() - 100 > 100 - columns.min()


@pytest.mark.parametrize(
    ("turn", "edge"),
    [
        (0.0, np.s_[-1, :]),
        (np.pi / 2, np.s_[:, 0]),
        (np.pi, np.s_[0, :]),
        (-np.pi / 2, np.s_[:, -1]),
    ],
)
def test_the_arm_comes_from_below_or_from_where_it_is_turned(
    turn: float, edge: tuple[object, ...]
) -> None:
    mask = hand_mask(POSES["stop"], (160, 160), HandView(90.0, turn=turn))
    touched = [bool(mask[side].any()) for side in (np.s_[-1, :], np.s_[0, :])]
    touched += [bool(mask[side].any()) for side in (np.s_[:, 0], np.s_[:, -1])]
    assert sum(touched) == 1
    assert mask[edge].any()  # type: ignore[index]


@pytest.mark.parametrize("name", POSES)
def test_a_hand_is_one_piece_and_narrowest_at_the_wrist(name: str) -> None:
    mask = hand_mask(POSES[name], (400, 400), HandView(240.0))
    assert cv2.connectedComponents(mask)[0] == 2
    rows = mask.sum(axis=1)
    wrist = 200 + 120  # half of the hand's length below the middle
    # Above: the ball of the thumb, or the palm; below: the forearm.
    assert rows[wrist - 60 : wrist - 20].max() > rows[wrist - 5 : wrist + 25].min()
    assert rows[-1] > rows[wrist - 5 : wrist + 25].min()


def test_lengths_are_those_of_the_view() -> None:
    flat = HandPose()
    for length in (80.0, 120.0):
        rows = np.nonzero(hand_mask(flat, (200, 200), HandView(length)).any(axis=1))[0]
        assert rows[0] == pytest.approx(100 - length / 2, abs=2)


def test_the_hand_is_where_the_view_says() -> None:
    one = hand_mask(POSES["stop"], (200, 400), HandView(80.0, (60.0, 100.0)))
    other = hand_mask(POSES["stop"], (200, 400), HandView(80.0, (100.0, 130.0)))
    np.testing.assert_array_equal(one[:100, :80], other[30:130, 40:120])


def test_a_hand_out_of_the_picture_is_not_seen() -> None:
    assert not hand_mask(POSES["up"], SMALL, HandView(100.0, (100.0, 500.0))).any()
    assert not hand_mask(POSES["up"], SMALL, HandView(100.0, (900.0, 80.0))).any()


@pytest.mark.parametrize("pose", [*POSES.values(), RELAXED], ids=[*POSES, "relaxed"])
def test_bones_keep_their_lengths_in_every_pose(pose: HandPose) -> None:
    for chain in pose_skeleton(pose).chains:
        lengths = np.linalg.norm(np.diff(chain.joints, axis=0), axis=1)
        bones = THUMB_BONES if chain.part == THUMB else FINGERS[chain.part - 1].phalanges
        np.testing.assert_allclose(lengths[:2], bones[:2])
        assert lengths[2] + chain.radii[3] == pytest.approx(bones[2])


def test_a_straight_middle_finger_ends_at_the_hands_length() -> None:
    middle = pose_skeleton(HandPose()).chains[1]
    assert middle.joints[3][1] + middle.radii[3] == pytest.approx(1.0, abs=0.01)


def test_a_bent_finger_comes_towards_the_eye() -> None:
    chain = pose_skeleton(HandPose(index=Finger(mcp=np.pi / 2))).chains[0]
    np.testing.assert_allclose(chain.joints[1:, :2] - chain.joints[0, :2], 0.0, atol=1e-12)
    assert (np.diff(chain.joints[:, 2]) > 0).all()


def test_blending_goes_from_one_pose_to_the_other() -> None:
    start, end = POSES["close"], POSES["stop"]
    assert blend(start, end, 0.0) == start
    np.testing.assert_allclose(blend(start, end, 1.0).angles(), end.angles())
    middle = np.array(blend(start, end, 0.5).angles())
    np.testing.assert_allclose(middle, (np.array(start.angles()) + end.angles()) / 2)


def test_angles_and_pose_are_the_same_thing() -> None:
    for pose in POSES.values():
        assert HandPose.from_angles(pose.angles()) == pose


def test_jitter_varies_without_bending_joints_backwards() -> None:
    generator = np.random.default_rng(0)
    for _ in range(50):
        varied = jitter(POSES["stop"], 0.2, generator)
        assert varied != POSES["stop"]
        assert all(min(f.mcp, f.pip, f.dip) >= 0 for f in varied.fingers)
    assert jitter(POSES["stop"], 0.0, generator) == POSES["stop"]


def test_ten_silhouettes_are_different() -> None:
    masks: list[NDArray[np.uint8]] = [hand_mask(pose, SMALL, VIEW) for pose in POSES.values()]
    for number, mask in enumerate(masks):
        for other in masks[:number]:
            # A little finger more or less is one part in twenty of hand and forearm.
            assert np.sum(mask != other) > 0.03 * mask.sum()
