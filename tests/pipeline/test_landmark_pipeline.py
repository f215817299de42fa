"""The whole way by landmarks: drawn hands in a room, photographs, and real people where present."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import simplejpeg

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.gestures.hand.poses import POSES
from app.pipeline import Gallery, PcaMatcher, Pipeline, extract_template
from app.pipeline.burst import see
from app.pipeline.hand_landmarks.photo import find_in_photo
from app.pipeline.replay import replay
from app.pipeline.still import take_shot
from app.pipeline.types import U8
from tests.pipeline.hand_landmarks.drawn import in_room, plain, room, two_in_room

SETTINGS = PipelineSettings()
PEOPLE = Path(__file__).resolve().parents[3] / "shared" / "data" / "people"
SHOWN = ("stop", "close", "up", "forward")


def jpeg(picture: U8) -> bytes:
    data: bytes = simplejpeg.encode_jpeg(
        np.ascontiguousarray(picture), 85, "BGR", colorsubsampling="420"
    )
    return data


@pytest.fixture(scope="module")
def matcher() -> PcaMatcher:
    """One photo of each gesture, before a plain wall."""
    photos = [(pose, extract_template(jpeg(plain(pose)), SETTINGS)) for pose in SHOWN]
    return PcaMatcher.fit(Gallery.of(photos), SETTINGS.match)


@pytest.mark.parametrize("pose", SHOWN)
def test_one_photo_is_enough_for_a_hand_in_a_room_that_sways(
    matcher: PcaMatcher, pose: str
) -> None:
    pipe = Pipeline(SETTINGS, matcher)
    rng = np.random.default_rng(1)
    results = []
    for seq in range(14):
        dx, dy = rng.integers(-3, 4, 2).tolist()
        results.append(pipe(jpeg(in_room(pose, (300 + dx, 255 + dy))), seq=seq, now=seq / 30))
    starts = [r for r in results if r.event is not None and r.event.phase == "start"]
    assert [r.gesture for r in starts] == [pose]
    assert starts[0].seq / 30 < 0.4
    last = results[-1]
    assert last.way.mode == "landmarks" and last.by_landmarks
    assert last.hand is not None and last.template is not None and last.roi is not None
    assert last.looks == 0  # the mask network was not asked


def test_every_frame_that_holds_no_gesture_says_why(matcher: PcaMatcher) -> None:
    pipe = Pipeline(SETTINGS, matcher)
    shown = [room()] * 3 + [in_room("stop")] * 12 + [in_room("forward")] * 14 + [room()] * 8
    results = [pipe(jpeg(picture), seq=n, now=n / 30) for n, picture in enumerate(shown)]
    idle = [r for r in results if r.gesture is None]
    assert all(r.cause is not None and r.reason for r in idle)
    causes = {r.cause for r in idle}
    assert {"no_hand", "waiting", "agreeing"} <= causes
    seen = [r for r in idle if r.match is not None and r.match.accepted]
    assert seen and {r.cause for r in seen} <= {"agreeing", "settling", "doubtful"}
    assert [r.event.gesture for r in results if r.event and r.event.phase == "start"] == [
        "stop",
        "forward",
    ]


def test_a_hand_on_its_way_starts_nothing(matcher: PcaMatcher) -> None:
    pipe = Pipeline(SETTINGS, matcher)
    for seq in range(14):
        picture = in_room("stop", (110 + 32 * seq, 260))
        result = pipe(jpeg(picture), seq=seq, now=seq / 30)
        assert result.event is None
    assert result.cause == "moving"
    assert "palm lengths a second" in (result.reason or "")


def test_a_second_hand_is_said(matcher: PcaMatcher) -> None:
    pipe = Pipeline(SETTINGS, matcher)
    picture = jpeg(two_in_room())
    results = [pipe(picture, seq=seq, now=seq / 30) for seq in range(24)]
    assert results[-1].cause == "two_hands"


def test_without_landmarks_in_every_gesture_silhouettes_are_compared() -> None:
    photos = [(pose, extract_template(jpeg(plain(pose)), SETTINGS)) for pose in SHOWN]
    whole = Gallery.of(photos)
    part = Gallery(whole.labels, whole.templates, (None, *whole.hands[1:]))
    matcher = PcaMatcher.fit(part, SETTINGS.match)
    assert matcher.by_landmarks is None
    assert matcher.best is matcher
    shown = extract_template(jpeg(in_room("up")), SETTINGS)
    assert shown.hand is not None
    match = matcher.match_photo(shown).match
    assert match is not None and match.gesture == "up"


def test_a_photograph_gives_landmarks_and_a_template_for_enrolment() -> None:
    shot = take_shot(jpeg(in_room("forward")), SETTINGS)
    assert shot.extraction.hand is not None
    assert shot.extraction.template.any()
    look = see(jpeg(in_room("forward")), SETTINGS)
    assert look.hand is not None and look.problem is None
    with pytest.raises(ImageRefused, match="two hands"):
        take_shot(jpeg(two_in_room()), SETTINGS)
    with pytest.raises(ImageRefused, match="no hand found"):
        take_shot(jpeg(room()), SETTINGS)


def test_the_paper_s_way_is_whole_and_loads_no_network(matcher: PcaMatcher) -> None:
    paper = PipelineSettings.model_validate({"binarise": {"mode": "threshold"}})
    pipe = Pipeline(paper, matcher)
    result = [pipe(jpeg(plain("up")), seq=n, now=n / 30) for n in range(12)][-1]
    assert result.way.mode == "threshold"
    assert result.hand is None and not result.by_landmarks
    assert result.timing_ms["find"] < 1


def test_every_starter_pose_is_found_in_a_room() -> None:
    for pose in POSES:
        assert find_in_photo(in_room(pose), SETTINGS.landmarks) is not None, pose


photos = pytest.mark.skipif(not PEOPLE.is_dir(), reason="the photographs are not beside this")


@photos
def test_landmarks_are_those_of_mediapipe_itself() -> None:
    lines = (PEOPLE / "landmarks" / "rps-faces.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    away, sides, missed = [], [], 0
    for row in rows[::12]:
        if len(row["hands"]) != 1:
            continue
        theirs = np.array(row["hands"][0]["points"], np.float32)
        picture = np.asarray(cv2.imread(str(PEOPLE / row["file"])), np.uint8)
        ours = find_in_photo(picture, SETTINGS.landmarks)
        if ours is None:
            missed += 1
            continue
        length = np.linalg.norm(theirs[9, :2] - theirs[0, :2])
        distances = np.linalg.norm(ours.hand.points[:, :2] - theirs[:, :2], axis=1)
        away.append(float(np.median(distances) / length))
        # MediaPipe's words are for mirrored pictures.
        sides.append((ours.hand.right > 0.5) == (row["hands"][0]["hand"] == "Left"))
    assert len(away) > 12
    assert missed == 0
    assert np.median(away) < 0.03
    assert np.mean(sides) > 0.9


@photos
@pytest.mark.parametrize("sign", ["B", "L"])
def test_a_real_person_s_sign_starts_from_one_photo(sign: str) -> None:
    enrolled = []
    for label in "ABCLVY":
        for path in sorted((PEOPLE / "meyyappan" / label).glob("*.jpg")):
            try:
                enrolled.append((label, extract_template(path.read_bytes(), SETTINGS, whole=False)))
                break
            except ImageRefused:
                continue
    matcher = PcaMatcher.fit(Gallery.of(enrolled), SETTINGS.match)
    clip = PEOPLE / "clips" / f"meyyappan-{sign}.mp4"
    told = list(replay(clip, Pipeline(SETTINGS, matcher)))
    started = [row["gesture"] for row in told if row.get("phase") == "start"]
    assert started and set(started) == {sign}
