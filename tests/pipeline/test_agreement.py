import pytest
from pydantic import ValidationError

from app.config import AgreementSettings
from app.pipeline.agreement import Agreement

AT_ONCE = AgreementSettings(votes=2, window=3, settle_s=0, doubt_s=0)


def play(votes, settings=AT_ONCE, fps=30, **seen):
    agree = Agreement(settings)
    events = [agree(vote, seq, seq / fps, **seen) for seq, vote in enumerate(votes)]
    return [None if e is None else (e.gesture, e.phase, e.seq) for e in events], agree


def started(*args, **kw):
    """Numbers and names of the frames that start something."""
    return [(e[2], e[0]) for e in play(*args, **kw)[0] if e and e[1] == "start"]


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


@pytest.mark.parametrize("fps", [10, 15, 30, 60])
def test_a_start_takes_its_time_at_any_frame_rate(fps):
    settings = AgreementSettings(votes=2, window=3, settle_s=0.2, doubt_s=0)
    ((frame, _),) = started(["a"] * fps, settings, fps)
    assert 0.2 <= frame / fps + 1e-9 <= 0.2 + 1 / fps


@pytest.mark.parametrize(("strangeness", "frame"), [(0.0, 3), (0.5, 6), (1.0, 9), (7.0, 9)])
def test_the_barely_accepted_must_stay_longer(strangeness, frame):
    settings = AgreementSettings(votes=2, window=3, settle_s=0.1, doubt_s=0.2, max_strangeness=1)
    assert started(["a"] * 15, settings, strangeness=strangeness) == [(frame, "a")]


def test_what_is_on_the_edge_of_rejection_never_starts():
    settings = AgreementSettings(settle_s=0, doubt_s=0, max_strangeness=0.95)
    assert started(["a"] * 30, settings, strangeness=0.97) == []
    assert started(["a"] * 30, settings, strangeness=0.94) == [(2, "a")]


def test_another_gesture_between_begins_the_time_anew():
    settings = AgreementSettings(votes=2, window=3, settle_s=0.1, doubt_s=0)
    assert started(["a", "a", "a", "b", "a", "a", "a", "a"], settings) == [(7, "a")]
    assert started(["a", "a", None, "a", "a"], settings) == [(3, "a")]


def test_as_many_empty_frames_as_the_window_begin_the_time_anew():
    settings = AgreementSettings(votes=2, window=3, settle_s=0.1, doubt_s=0)
    assert started(["a", "a", None, None, None, "a", "a", "a", "a"], settings) == [(8, "a")]


def test_nothing_starts_until_the_hand_has_settled():
    agree = Agreement(AT_ONCE)
    assert not any(agree("a", n, n / 30, settled=False) for n in range(30))
    event = agree("a", 30, 1.0)
    assert event is not None
    assert event.phase == "start"


def test_a_held_gesture_goes_on_while_the_hand_is_unsettled():
    agree = Agreement(AT_ONCE)
    agree("a", 0, 0.0)
    agree("a", 1, 0.03)
    event = agree("a", 2, 0.06, settled=False)
    assert event is not None
    assert event.phase == "hold"


def test_what_was_shown_before_a_gap_does_not_count():
    settings = AgreementSettings(votes=2, window=3, settle_s=0.2, doubt_s=0)
    agree = Agreement(settings)
    for seq in range(3):
        agree("a", seq, seq / 30)
    assert agree("a", 3, 1.0) is None
    assert agree("a", 4, 1.1) is None
    assert agree("a", 5, 1.2) is not None


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
    with pytest.raises(ValidationError, match=r"votes \(5\) must not exceed window \(4\)"):
        AgreementSettings(votes=5, window=4)
