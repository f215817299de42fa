import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.config import PipelineSettings
from app.errors import FrameRefused
from app.pipeline import STAGES, Gallery, PcaMatcher, Pipeline
from app.pipeline.still import extract_template
from tests.pipeline import shots
from tests.pipeline.drawing import SETTINGS, TURNS, draw, draw_mask, gallery, jpeg, matcher

MATCHER = matcher()
WALL = jpeg(draw("fist", hand=(190, 190, 190)))


def pipeline(**sections) -> Pipeline:
    return Pipeline(SETTINGS.model_copy(update=sections), MATCHER)


def show(pipe: Pipeline, frames, start=0):
    return [pipe(data, seq=n, now=n / 30) for n, data in enumerate(frames, start)]


def test_hand_at_rest_starts_its_gesture_within_300_ms():
    results = show(pipeline(), [jpeg(draw("two"))] * 10)
    first = next(r for r in results if r.event and r.event.phase == "start")
    assert first.seq / 30 < 0.27
    assert first.gesture == "two"
    assert [r.reason for r in results[:2]] == ["waiting for three frames"] * 2
    assert results[-1].event is not None
    assert results[-1].event.phase == "hold"


@pytest.mark.parametrize("side", TURNS)
def test_arm_from_any_side(side):
    size = (640, 480)
    enrolled = gallery(("fist", "one", "five"), SETTINGS, side=side)
    pipe = Pipeline(SETTINGS, PcaMatcher.fit(enrolled, SETTINGS.match))
    data = jpeg(draw("one", side=side, shift=(12, -8)))
    result = show(pipe, [data] * 10)[-1]
    assert result.gesture == "one"
    assert result.wrist is not None
    assert result.wrist.side == side
    x, y, width, height = result.roi
    assert 0 <= x < x + width <= size[0]
    assert 0 <= y < y + height <= size[1]
    ys, xs = np.nonzero(draw_mask("one", side=side, shift=(12, -8)))
    ends = {"left": x + width - xs.max(), "right": x - xs.min(), "top": y + height - ys.max()}
    assert abs(ends.get(side, y - ys.min())) <= 6


@pytest.mark.parametrize("channel", ["luminance", "cr"])
@pytest.mark.parametrize(
    ("hand", "wall"), [((120, 150, 210), (40, 40, 40)), ((60, 80, 140), (230, 230, 230))]
)
def test_light_on_dark_and_dark_on_light(channel, hand, wall):
    pipe = pipeline(binarise=SETTINGS.binarise.model_copy(update={"channel": channel}))
    assert show(pipe, [jpeg(draw("five", hand=hand, wall=wall))] * 10)[-1].gesture == "five"


def test_grey_frames_work_as_well():
    from tests.pipeline.drawing import cv2, encoded

    grey = cv2.cvtColor(draw("two"), cv2.COLOR_BGR2GRAY)
    assert show(pipeline(), [encoded(grey, ".jpg")] * 10)[-1].gesture == "two"


def test_moving_hand_says_how_much_moved():
    frames = [jpeg(draw("two", shift=(40 * n, 0))) for n in range(-3, 3)]
    result = show(pipeline(), frames)[-1]
    assert result.reason == f"hand still moving: {result.motion:.1%} of the pixels changed"
    assert result.motion > 0.01
    assert (result.still, result.match, result.template) == (False, None, None)
    assert result.roi is not None


def test_no_hand_and_unknown_hand_have_reasons():
    pipe = pipeline()
    assert show(pipe, [WALL] * 10)[-1].reason.startswith(
        "no hand in the picture: hardly any contrast ("
    )
    pipe.matcher = matcher(("fist", "one"))
    result = show(pipe, [jpeg(draw("five"))] * 10, start=10)[-1]
    assert result.reason.startswith("unknown hand: closest is ")
    assert result.match is not None
    assert not result.match.accepted
    assert result.gesture is None
    assert result.as_message()["match"] is None


def test_speck_and_wallpaper_are_no_hand():
    speck = jpeg(draw("fist", scale=0.05, shift=(0, 200)))
    assert "the largest thing fills 0.1% of it" in show(pipeline(), [speck] * 3)[-1].reason


def test_empty_gallery_says_so():
    pipe = Pipeline(SETTINGS, PcaMatcher.fit(Gallery.empty(), SETTINGS.match))
    result = show(pipe, [jpeg(draw("two"))] * 10)[-1]
    assert result.reason == "no gesture is enrolled yet"
    assert result.match is None


def test_trembling_hand_keeps_its_gesture():
    rng = np.random.default_rng(0)
    shifts = rng.integers(-2, 3, (60, 2))
    results = show(pipeline(), [jpeg(draw("five", shift=tuple(shift))) for shift in shifts])
    phases = [r.event.phase for r in results if r.event]
    assert phases == ["start"] + ["hold"] * (len(phases) - 1)
    assert len(phases) > 50


def test_hand_taken_away_ends_within_200_ms():
    results = show(pipeline(), [jpeg(draw("two"))] * 12 + [WALL] * 8)
    end = next(r for r in results if r.event and r.event.phase == "end")
    assert (end.seq - 12) / 30 <= 0.2
    assert results[-1].gesture is None


def test_tick_ends_when_frames_stop():
    pipe = pipeline()
    show(pipe, [jpeg(draw("two"))] * 10)
    assert pipe.tick(9 / 30 + 0.1) is None
    event = pipe.tick(9 / 30 + 0.2)
    assert event is not None
    assert (event.gesture, event.phase, event.seq) == ("two", "end", 9)


def test_refused_frame_changes_nothing():
    pipe = pipeline()
    show(pipe, [jpeg(draw("two"))] * 10)
    with pytest.raises(FrameRefused):
        pipe(b"no", seq=10, now=10 / 30)
    result = pipe(jpeg(draw("two")), seq=11, now=11 / 30)
    assert result.event is not None
    assert result.event.phase == "hold"


def test_reset_waits_for_three_frames_again():
    pipe = pipeline()
    show(pipe, [jpeg(draw("two"))] * 10)
    pipe.reset()
    assert pipe.tick(99.0) is None
    assert pipe(jpeg(draw("two")), seq=5, now=1.0).reason == "waiting for three frames"


def test_timing_names_every_stage():
    results = show(pipeline(), [jpeg(draw("two"))] * 10)
    for result in results:
        assert set(result.timing_ms) == {*STAGES, "total"}
    timing = dict(results[-1].timing_ms)
    total = timing.pop("total")
    assert timing.pop("find") == 0  # these settings ask for the mask alone
    assert all(ms > 0 for ms in timing.values())
    assert sum(timing.values()) == pytest.approx(total, abs=0.5)


def test_results_tell_how_often_the_network_ran():
    """On the first frame of all, and not on the next, which shows the same."""
    learned = pipeline(binarise=SETTINGS.binarise.model_copy(update={"mode": "learned"}))
    first, second = show(learned, [jpeg(draw("two"))] * 2)
    assert first.looks >= 1
    assert second.looks == 0
    threshold = pipeline(binarise=SETTINGS.binarise.model_copy(update={"mode": "threshold"}))
    assert show(threshold, [jpeg(draw("two"))])[0].looks == 0


def test_message_is_plain_json():
    result = show(pipeline(), [jpeg(draw("two"))] * 10)[-1]
    message = json.loads(json.dumps(result.as_message(tick=7), allow_nan=False))
    assert list(message) == [
        "type",
        "seq",
        "tick",
        "motion",
        "still",
        "roi",
        "mask",
        "match",
        "reason",
        "cause",
        "timing_ms",
    ]
    assert (message["type"], message["seq"], message["tick"]) == ("frame", 9, 7)
    assert message["mask"] == {"mode": "threshold", "why": "the settings say so"}
    assert message["match"]["gesture"] == "two"
    assert message["reason"] is None


def test_results_show_what_moved_and_where_the_palm_is():
    moving = show(pipeline(), [jpeg(draw("two", shift=(40 * n, 0))) for n in range(3)])
    assert [result.mismatch is None for result in moving] == [True, True, False]
    last = moving[-1]
    assert last.mismatch.shape == last.mask.shape
    assert last.mismatch.mean() == pytest.approx(last.motion)
    assert (last.cause, last.look) == ("moving", None)
    # In the frame's own pixels: the hand is as far to the right as it was drawn.
    assert last.palm.x - moving[0].palm.x == pytest.approx(80, abs=4)
    x, y, width, height = last.roi
    assert x < last.palm.x < x + width
    assert y < last.palm.y < y + height
    assert last.palm.radius < width / 2

    still = show(pipeline(), [jpeg(draw("two"))] * 10)[-1]
    assert still.look.distances.min() <= still.match.distance + 1e-6
    assert show(pipeline(), [WALL])[-1].palm is None


def test_results_stay_valid_after_the_next_frame():
    pipe = pipeline()
    first = show(pipe, [jpeg(draw("two"))] * 10)[-1]
    mask, template = first.mask.copy(), first.template.copy()
    mismatch = first.mismatch.copy()
    show(pipe, [WALL] * 10, start=10)
    assert np.array_equal(first.mask, mask)
    assert np.array_equal(first.template, template)
    assert np.array_equal(first.mismatch, mismatch)


def test_same_frames_lead_to_the_same_results():
    frames = [jpeg(draw("five", shift=(n, 0))) for n in (0, 0, 1, 1, 0)]

    def run():
        return [(r.match, r.roi, r.motion, r.event) for r in show(pipeline(), frames)]

    assert run() == run()


def test_frame_size_may_change():
    pipe = pipeline()
    show(pipe, [jpeg(draw("two"))] * 10)
    results = show(pipe, [jpeg(draw("two", size=(320, 240)))] * 10, start=10)
    assert results[-1].gesture == "two"


def test_paper_settings_work_too():
    paper = PipelineSettings.model_validate(
        {
            "binarise": {"mode": "threshold", "channel": "luminance"},
            "wrist": {"mode": "histogram"},
            "match": {"features": "binary", "turns": [0], "cuts": [], "trims": [0]},
        }
    )
    pipe = Pipeline(paper, matcher(settings=paper))
    assert show(pipe, [jpeg(draw("two"))] * 10)[-1].gesture == "two"


SMALL = jpeg(draw("two", size=(64, 48)))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(SMALL) - 1), st.integers(0, 255)), max_size=6))
def test_changed_bytes_raise_nothing_but_refusals(changes):
    data = bytearray(SMALL)
    for at, value in changes:
        data[at] = value
    pipe = pipeline()
    for n in range(3):
        try:
            pipe(bytes(data), seq=n, now=n / 30)
        except FrameRefused:
            return


def test_why_nothing_is_shown_has_a_word_for_programs():
    still = [jpeg(draw("two"))] * 10
    assert [r.cause for r in show(pipeline(), [WALL] * 4)] == ["no_hand"] * 4
    results = show(pipeline(), still)
    assert [r.cause for r in results[:2]] == ["waiting", "waiting"]
    assert results[-1].cause is None
    strict = pipeline(match=SETTINGS.match)
    strict.matcher = PcaMatcher.fit(
        gallery(("fist", "one", "five"), SETTINGS),
        SETTINGS.match.model_copy(update={"max_distance": 1e-3, "min_reach": 0.0}),
    )
    assert show(strict, still)[-1].cause == "unknown_hand"
    close = pipeline()
    close.matcher = PcaMatcher.fit(
        gallery(("fist", "one", "five"), SETTINGS),
        SETTINGS.match.model_copy(update={"min_margin": 100.0, "max_distance": 100.0}),
    )
    undecided = show(close, [jpeg(draw("one"))] * 10)[-1]
    assert undecided.cause == "low_margin"
    assert undecided.reason.startswith("undecided: ")
    empty = pipeline()
    empty.matcher = PcaMatcher.fit(Gallery.empty(), SETTINGS.match)
    assert show(empty, still)[-1].cause == "nothing_enrolled"
    moving = [jpeg(draw("two", shift=(12 * n, 0))) for n in range(6)]
    assert show(pipeline(), moving)[-1].cause == "moving"


@pytest.mark.parametrize("mode", ["threshold", "learned"])
def test_a_second_hand_ends_the_gesture_and_says_so(mode):
    everything = PipelineSettings()
    binarise = everything.binarise.model_copy(update={"mode": mode})
    motion = everything.motion.model_copy(update={"settle_s": 0.0})
    chosen = everything.model_copy(update={"binarise": binarise, "motion": motion})
    one = shots.hand("stop", 200.0, (180.0, 240.0))
    template = extract_template(shots.jpeg(one), chosen).template
    lax = chosen.match.model_copy(update={"calibrate": False, "max_distance": 9, "max_error": 9})
    pipe = Pipeline(chosen, PcaMatcher.fit(Gallery(("stop",), template[None]), lax))
    # Nothing stands still in front of a real camera, or the last mask would be taken again.
    alone = [shots.jpeg(shots.noisy(one, n)) for n in range(15)]
    both = [shots.jpeg(shots.noisy(shots.two_hands(), n)) for n in range(25)]
    results = show(pipe, alone)
    assert (results[-1].gesture, results[-1].cause) == ("stop", None)
    results = show(pipe, both, 15)
    assert results[-1].cause == "two_hands"
    assert results[-1].reason == "two hands in the picture: show one"
    assert results[-1].gesture is None
    assert "end" in [r.event.phase for r in results if r.event]
    assert show(pipe, alone, 40)[-1].gesture == "stop"


def test_the_digest_tells_whether_any_pixel_changed():
    pipe = pipeline()
    picture = draw("two")
    changed = picture.copy()
    changed[::7, ::5] ^= 8
    first, same, other = show(pipe, [jpeg(picture), jpeg(picture), jpeg(changed)])
    assert first.digest == same.digest != other.digest
