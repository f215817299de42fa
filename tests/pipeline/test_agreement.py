import pytest
from pydantic import ValidationError

from app.config import AgreementSettings
from app.pipeline.agreement import Agreement


def play(votes, settings=None, fps=30):
    agree = Agreement(settings or AgreementSettings())
    events = [agree(vote, seq, seq / fps) for seq, vote in enumerate(votes)]
    return [None if e is None else (e.gesture, e.phase, e.seq) for e in events], agree


def test_second_vote_of_three_starts():
    events, agree = play(["a", None, "a", "a"])
    assert events == [None, None, ("a", "start", 2), ("a", "hold", 3)]
    assert agree.gesture == "a"


def test_single_flicker_starts_nothing():
    events, _ = play([None, "a", None, None, "b", None, None])
    assert not any(events)


def test_single_flicker_does_not_end():
    events, _ = play(["a", "a", "b", "a", None, None, None, "a"])
    assert events[1:] == [("a", "start", 1), *(("a", "hold", n) for n in range(2, 8))]


def test_held_gesture_ends_after_its_release_time():
    events, agree = play(["a", "a", *[None] * 6])
    assert [e and e[1] for e in events] == [None, "start", *["hold"] * 4, "end", None]
    assert agree.gesture is None


def test_another_gesture_ends_it_and_starts_with_the_next_frame():
    events, _ = play(["a", "a", "b", "b", "b"])
    assert events[2:] == [("a", "hold", 2), ("a", "end", 3), ("b", "start", 4)]


def test_tick_ends_when_frames_stop():
    _, agree = play(["a", "a"])
    assert agree.tick(1 / 30 + 0.14) is None
    event = agree.tick(1 / 30 + 0.16)
    assert event is not None
    assert (event.gesture, event.phase, event.seq) == ("a", "end", 1)
    assert agree.tick(9) is None


def test_votes_from_before_a_gap_do_not_count():
    _, agree = play(["a", "a"])
    agree.tick(5)
    assert agree("a", 2, 5.0) is None


def test_reset_forgets_without_an_event():
    _, agree = play(["a", "a"])
    agree.reset()
    assert agree.gesture is None
    assert agree("a", 2, 0.1) is None


def test_more_votes_than_frames_are_refused():
    with pytest.raises(ValidationError, match=r"votes \(4\) must not exceed window \(3\)"):
        AgreementSettings(votes=4)
