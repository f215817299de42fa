import numpy as np
import pytest

from app.config import LandmarkSettings
from app.pipeline.hand_landmarks.tracker import SECOND_EVERY, HandTracker, palm_middle
from tests.pipeline.hand_landmarks.drawn import in_room, room, two_in_room


@pytest.fixture
def track() -> HandTracker:
    return HandTracker(LandmarkSettings())


def test_the_detector_runs_only_while_no_hand_is_followed(track: HandTracker) -> None:
    first = track(in_room())
    assert first.found and first.hand is not None
    for shift in range(8):
        seen = track(in_room(at=(300 + 6 * shift, 260)))
        assert seen.hand is not None
        assert not seen.found
        assert palm_middle(seen.hand)[0] - palm_middle(first.hand)[0] == pytest.approx(
            6 * shift, abs=12
        )


def test_a_hand_that_is_gone_is_lost_at_once_and_found_again(track: HandTracker) -> None:
    assert track(in_room()).hand is not None
    lost = track(room())
    assert lost.hand is None
    assert lost.unsure is not None and lost.unsure < 0.5
    assert not lost.found  # one frame never pays for both networks and the detector
    assert track(room()).found
    back = [track(in_room(at=(380, 250))).hand for _ in range(2)]
    assert back[-1] is not None


def test_a_second_hand_is_seen_and_seen_to_go(track: HandTracker) -> None:
    two = two_in_room()
    assert any(track(two).second for _ in range(SECOND_EVERY + 3))
    assert track(two).second
    one = two.copy()
    one[:, 320:] = room()[:, 320:]
    other = two.copy()
    other[:, :320] = room()[:, :320]
    hand = track(two).hand
    assert hand is not None
    left = palm_middle(hand)[0] < 320
    alone = [track(one if left else other).second for _ in range(SECOND_EVERY)]
    assert alone[-1] is False


def test_reset_forgets_the_hand(track: HandTracker) -> None:
    track(in_room())
    track.reset()
    assert track(in_room()).found


def test_a_grey_picture_will_do(track: HandTracker) -> None:
    grey = np.ascontiguousarray(in_room()[:, :, 1:2])
    assert any(track(grey).hand is not None for _ in range(2))
