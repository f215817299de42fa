import cv2
import pytest

from app.errors import Invalid, NotFound
from app.pipeline import Pipeline
from app.pipeline.replay import replay
from tests.pipeline.drawing import SETTINGS, draw, encoded, jpeg, matcher

MATCHER = matcher()


def pipeline() -> Pipeline:
    return Pipeline(SETTINGS, MATCHER)


def phases(messages):
    gestures = [(m["gesture"], m["phase"]) for m in messages if m["type"] == "gesture"]
    return [pair for n, pair in enumerate(gestures) if n == 0 or pair != gestures[n - 1]]


def test_folder_of_frames(tmp_path):
    for n in range(9):
        (tmp_path / f"{n}.jpg").write_bytes(jpeg(draw("two")))
    (tmp_path / "9.png").write_bytes(encoded(draw("two")))
    (tmp_path / "a.jpg").write_bytes(b"broken")
    (tmp_path / "readme.txt").write_text("no frame")
    messages = list(replay(tmp_path, pipeline()))
    assert [m["seq"] for m in messages if m["type"] == "frame"] == list(range(10))
    assert phases(messages) == [("two", "start"), ("two", "hold"), ("two", "end")]
    error = next(m for m in messages if m["type"] == "error")
    assert (error["code"], error["seq"]) == ("frame_not_jpeg", 10)
    assert messages[-1] == {"type": "gesture", "gesture": "two", "phase": "end", "seq": 9}


def test_video(tmp_path):
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (640, 480))
    for shape in ["two"] * 14 + ["five"] * 14:
        writer.write(draw(shape))
    writer.release()
    messages = list(replay(path, pipeline()))
    assert sum(m["type"] == "frame" for m in messages) == 28
    order = [phase for phase in phases(messages) if phase[1] != "hold"]
    assert order == [("two", "start"), ("two", "end"), ("five", "start"), ("five", "end")]


def test_large_frames_are_made_smaller(tmp_path):
    (tmp_path / "a.png").write_bytes(encoded(draw("two", size=(1920, 1440))))
    assert next(iter(replay(tmp_path, pipeline())))["type"] == "frame"


def test_what_cannot_be_read(tmp_path):
    with pytest.raises(NotFound, match=r"^no file or folder "):
        replay(tmp_path / "none", pipeline())
    with pytest.raises(Invalid, match=r"^no frame in "):
        list(replay(tmp_path, pipeline()))
    with pytest.raises(Invalid, match=r"^-1 frames a second: more than 0 is needed$"):
        replay(tmp_path, pipeline(), fps=-1)
    (tmp_path / "text.mp4").write_text("no video")
    with pytest.raises(Invalid, match=r"is not a video that can be read$"):
        replay(tmp_path / "text.mp4", pipeline())
