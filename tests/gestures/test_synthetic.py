import json
import time
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.config import PipelineSettings
from app.errors import Invalid
from app.gestures import read_set
from app.gestures.hand import POSES
from app.gestures.synthetic import (
    CLIP,
    Caption,
    Step,
    SyntheticOperator,
    operator_captions,
    parse_script,
    write_mjpeg,
    write_webm,
    write_y4m,
)
from app.pipeline import Gallery, PcaMatcher, Pipeline
from tests.gestures.conftest import STARTER


@pytest.fixture(scope="module")
def matcher() -> PcaMatcher:
    gestures = read_set(STARTER)
    templates = [np.frombuffer(t, np.uint8) for g in gestures for t in g.templates]
    pixels = np.unpackbits(np.array(templates), axis=1).reshape(-1, 80, 60)
    labels = tuple(gesture.name for gesture in gestures for _ in gesture.templates)
    return PcaMatcher.fit(Gallery(labels, pixels), PipelineSettings().match)


@pytest.mark.parametrize("name", POSES)
def test_the_pipeline_reads_what_the_operator_shows(name: str, matcher: PcaMatcher) -> None:
    """Every gesture: nothing while there is no hand, then it and only it, soon after it rests."""
    operator = SyntheticOperator([Step(None, 0.3), Step(name, 1.0), Step(None, 0.6)])
    pipeline = Pipeline(PipelineSettings(), matcher)
    started = {}
    for number, frame in enumerate(operator.frames()):
        data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        result = pipeline(data, seq=number, now=number / 30)
        if result.event is not None and result.event.phase == "start":
            started[result.event.gesture] = number / 30
    (caption,) = operator.captions
    assert list(started) == [name]
    assert caption.start_s - 0.2 <= started[name] <= caption.start_s + 0.4


def test_a_resting_hand_trembles_but_counts_as_still(matcher: PcaMatcher) -> None:
    operator = SyntheticOperator([Step("stop", 1.5)], look=SyntheticOperator([]).look)
    pipeline = Pipeline(PipelineSettings(), matcher)
    frames = list(operator.frames())[-40:]
    motion = []
    for number, frame in enumerate(frames):
        data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        motion.append(pipeline(data, seq=number, now=number / 30).motion)
    seen = [share for share in motion if share is not None]
    assert len(seen) > 30
    assert 0 < max(seen) < 0.01
    assert any(np.any(a != b) for a, b in pairwise(frames))


def test_frames_are_a_webcams() -> None:
    operator = SyntheticOperator([Step(None, 0.2), Step("up", 0.2)])
    frames = list(operator.frames())
    assert {(frame.shape, frame.dtype) for frame in frames} == {((480, 640, 3), np.dtype("uint8"))}
    assert len(frames) == len(operator)
    assert operator.duration_s == pytest.approx(len(frames) / 30)


def test_the_same_seed_gives_the_same_frames() -> None:
    script = [Step(None, 0.1), Step("up", 0.1), Step("down", 0.1)]
    one, same = (list(SyntheticOperator(script, seed=1).frames()) for _ in range(2))
    np.testing.assert_array_equal(one, same)
    other = list(SyntheticOperator(script, seed=2).frames())
    assert np.any(np.array(one) != other)


def test_captions_say_when_a_gesture_rests() -> None:
    operator = SyntheticOperator(parse_script("none 2, forward 4, up 1, none 2"))
    forward, up = operator.captions
    assert (forward.gesture, up.gesture) == ("forward", "up")
    assert forward.start_s == pytest.approx(2 + 0.6, abs=0.05)
    assert forward.end_s - forward.start_s == pytest.approx(4.0)
    assert up.start_s - forward.end_s == pytest.approx(0.45, abs=0.05)
    assert operator.duration_s == pytest.approx(up.end_s + 0.6 + 2, abs=0.05)


def test_the_picture_is_empty_when_no_hand_is_in_view() -> None:
    operator = SyntheticOperator(parse_script("none 0.2, close 0.2, none 0.2"))
    frames = list(operator.frames())
    for frame in (frames[0], frames[-1]):
        assert np.abs(frame.astype(int) - frames[1]).mean() < 4
    assert np.abs(frames[len(frames) // 2].astype(int) - frames[0]).mean() > 6


def test_movement_is_smooth() -> None:
    """The hand's upper edge rises without jumps: never faster than minimum jerk's peak, 1.875."""
    operator = SyntheticOperator([Step(None, 0.1), Step("close", 0.1)], tremor=0.0)
    tops = []
    for frame in operator.frames():
        skin = frame[..., 2].astype(int) - frame[..., 0] > 25
        rows = np.nonzero(skin.sum(axis=1) > 20)[0]
        tops.append(rows[0] if len(rows) else 480)
    steps = -np.diff(tops)
    assert steps.min() >= -2
    assert steps.max() < 480 * 1.875 / (0.6 * 30) + 3
    assert tops[-1] < 250


def test_scripts_are_read() -> None:
    assert parse_script("none 2, forward 4.5,none 0.25") == (
        Step(None, 2.0),
        Step("forward", 4.5),
        Step(None, 0.25),
    )


@pytest.mark.parametrize("text", ["", "forward", "4 forward", "up 1;down 1", "up -1", "up 1,"])
def test_bad_scripts_are_refused(text: str) -> None:
    with pytest.raises(Invalid, match="is not a step; write a gesture"):
        parse_script(text)


@pytest.mark.parametrize("script", ["waving 1", "up 0", "up 99999"])
def test_bad_steps_are_refused(script: str) -> None:
    with pytest.raises(Invalid):
        SyntheticOperator(parse_script(script))


def test_the_clip_shows_everything_but_stop() -> None:
    captions = operator_captions()
    assert {caption.gesture for caption in captions} == set(POSES) - {"stop"}
    assert all(a.end_s < b.start_s for a, b in pairwise(captions))
    assert all(caption.end_s - caption.start_s > 1.0 for caption in captions)
    assert 20 <= SyntheticOperator(CLIP).duration_s <= 30


def test_a_webm_clip_is_vp8_and_still_recognised(tmp_path: Path, matcher: PcaMatcher) -> None:
    path = tmp_path / "clip.webm"
    operator = SyntheticOperator(parse_script("none 0.3, back 0.7, none 0.3"))
    write_webm(operator.frames(), path)
    assert path.read_bytes()[:4] == b"\x1a\x45\xdf\xa3"
    assert b"V_VP8" in path.read_bytes()[:4096]
    assert [entry.name for entry in tmp_path.iterdir()] == ["clip.webm"]
    video = cv2.VideoCapture(str(path))
    pipeline = Pipeline(PipelineSettings(), matcher)
    seen: defaultdict[str, int] = defaultdict(int)
    count = 0
    while (read := video.read())[0]:
        data = cv2.imencode(".jpg", read[1])[1].tobytes()
        held = pipeline(data, seq=count, now=count / 30).gesture
        seen[held or ""] += 1
        count += 1
    assert count == len(operator)
    assert set(seen) == {"", "back"}
    assert seen["back"] > 15


def test_an_interrupted_clip_leaves_nothing_behind(tmp_path: Path) -> None:
    def frames():  # type: ignore[no-untyped-def]
        yield np.zeros((48, 64, 3), np.uint8)
        raise OSError("no more")

    with pytest.raises(OSError, match="no more"):
        write_webm(frames(), tmp_path / "clip.webm")
    assert list(tmp_path.iterdir()) == []


def test_mjpeg_is_jpeg_after_jpeg(tmp_path: Path) -> None:
    path = tmp_path / "webcam.mjpeg"
    frames = list(SyntheticOperator([Step("up", 0.1)], size=(160, 120)).frames())
    assert write_mjpeg(frames, path) == len(frames)
    data = path.read_bytes()
    assert data.count(b"\xff\xd8\xff") == len(frames)
    first = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(first.astype(int) - frames[0]).mean() < 4


def test_y4m_has_its_header_and_whole_frames(tmp_path: Path) -> None:
    path = tmp_path / "webcam.y4m"
    frames = list(SyntheticOperator([Step("up", 0.1)], size=(160, 120)).frames())
    assert write_y4m(frames, path, fps=30) == len(frames)
    header, rest = path.read_bytes().split(b"\n", 1)
    assert header == b"YUV4MPEG2 W160 H120 F30:1 Ip A1:1 C420jpeg"
    assert len(rest) == len(frames) * (6 + 160 * 120 * 3 // 2)
    video = cv2.VideoCapture(str(path))
    assert np.abs(video.read()[1].astype(int) - frames[0]).mean() < 12


def test_frames_are_drawn_quickly_enough() -> None:
    """Far from the limit, so that a busy machine passes: some ms a frame, not some hundred."""
    operator = SyntheticOperator(parse_script("none 0.2, up 1, down 1, none 0.2"))
    begin = time.process_time()
    count = sum(1 for _ in operator.frames())
    assert (time.process_time() - begin) / count < 0.1


MEDIA = Path(__file__).parents[2] / "app" / "static" / "media"


def test_the_shipped_clip_is_what_is_drawn() -> None:
    """Draw it anew with ``farhand gestures draw-operator`` when this fails."""
    captions = json.loads((MEDIA / "operator.json").read_text())
    assert [Caption(**row) for row in captions] == list(operator_captions())
    operator = SyntheticOperator(CLIP)
    video = cv2.VideoCapture(str(MEDIA / "operator.webm"))
    for number, drawn in enumerate(operator.frames()):
        there, shown = video.read()
        assert there
        if number % 20 == 0:
            assert np.abs(shown.astype(int) - drawn).mean() < 4, number
        if number > 150:
            break
    video.release()
