"""Pictures that have stopped, on either side."""

import pytest

from app.gateway.eyes import LIVE_FRAMES, FrozenCamera, PictureAge

FRAME_S = 1 / 30


def play(camera: FrozenCamera, digests: list[int], start: float = 0.0) -> list[bool]:
    return [camera(digest, start + n * FRAME_S) for n, digest in enumerate(digests)]


def live(limit_ms: int = 500) -> FrozenCamera:
    """A camera that has been changing for a second; the next frame comes at 1 s."""
    camera = FrozenCamera(limit_ms)
    assert not any(play(camera, list(range(30))))
    assert camera.live
    return camera


def test_a_live_camera_that_sends_the_same_pixels_for_half_a_second_is_frozen() -> None:
    camera = live()
    answers = play(camera, [99] * 30, 1.0)
    first = answers.index(True)
    assert 0.5 - FRAME_S / 2 <= first * FRAME_S <= 0.5 + FRAME_S
    assert all(answers[first:])
    assert not camera(100, 2.1)  # alive again
    assert any(play(camera, [7] * 20, 2.2))


def test_a_program_that_shows_one_picture_over_and_over_never_had_a_camera() -> None:
    camera = FrozenCamera(500)
    assert not any(play(camera, [1] * 300))
    # Nor does one that shows a few pictures, each for a while.
    assert not any(play(camera, [n // 5 for n in range(300)], 20.0))
    assert not any(play(camera, list(range(LIVE_FRAMES - 1)) + [0] * 100, 40.0))
    assert not camera.live


def test_changes_that_come_slowly_are_no_camera() -> None:
    camera = FrozenCamera(500)
    assert not any(camera(n, n * 0.5) for n in range(40))
    assert not camera.live


def test_frozen_can_be_switched_off() -> None:
    assert not any(play(live(limit_ms=0), [1] * 300, 1.0))


def test_a_client_that_never_tells_what_it_shows_is_not_judged() -> None:
    assert PictureAge(1000)(10**6) is None


@pytest.mark.parametrize(("age", "stale"), [(0, False), (1000, False), (1001, True)])
def test_the_newest_picture_counts_whichever_camera_it_is_of(age: int, stale: bool) -> None:
    pictures = PictureAge(1000)
    pictures.saw("scene", 1000)
    pictures.saw("wrist", 5000)
    assert (pictures(5000 + age) is not None) is stale


def test_an_old_picture_is_told_with_its_age() -> None:
    pictures = PictureAge(1000)
    pictures.saw("wrist", 5000)
    assert pictures(6500) == (
        "the picture of the robot that you see is 1.5 s old, at most 1 s are allowed"
    )
    # A node that was started again counts from another number.
    assert pictures(100) == (
        "the picture of the robot that you see is not a new one, at most 1 s are allowed"
    )
    assert PictureAge(0)(10**9) is None
