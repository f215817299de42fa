"""Enrolment with a conscience: bad shots, confusions, inactive gestures and bursts over REST."""

import json
from collections.abc import Callable
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
import simplejpeg

from app.config import PipelineSettings
from app.pipeline.hand_landmarks.live import wanted
from tests.gateway.running import Running

Hand = Callable[..., bytes]
HOME = json.dumps({"type": "home"})


def files(images: tuple[bytes, ...]) -> list[Any]:
    return [("images", (f"{n}.jpg", image, "image/jpeg")) for n, image in enumerate(images)]


def enrol(server: Running, name: str, *images: bytes, **fields: str) -> httpx.Response:
    data = {"name": name, "action": HOME, **fields}
    return server.http.post("/api/gestures", data=data, files=files(images))


def check(server: Running, *images: bytes, **fields: str) -> httpx.Response:
    return server.http.post("/api/gestures/check", data=fields, files=files(images))


def names(server: Running) -> list[str]:
    return [gesture["name"] for gesture in server.http.get("/api/gestures").json()]


def blurred(image: bytes) -> bytes:
    picture = cv2.GaussianBlur(simplejpeg.decode_jpeg(image, "BGR"), (0, 0), 10)
    return simplejpeg.encode_jpeg(np.ascontiguousarray(picture), 90, "BGR")


def test_a_bad_shot_is_refused_with_its_reason(lasting: Running, hand: Hand) -> None:
    before = names(lasting)
    error = enrol(lasting, "wave", hand("up"), blurred(hand("up"))).json()["error"]
    assert error["code"] == "image_refused"
    assert error["message"].startswith("image 2: the picture is blurred")
    seen = error["detail"].pop("seen")
    assert error["detail"] == {"problem": "blurred", "image": 2}
    assert seen["size"] == [640, 480]
    assert names(lasting) == before
    # Asking what a blurred picture shows is not refused.
    answer = lasting.http.post("/api/recognise", content=blurred(hand("up"))).json()
    assert "blurred" not in str(answer["reason"])


def test_checking_judges_each_image_and_stores_nothing(lasting: Running, hand: Hand) -> None:
    before = lasting.http.get("/api/gestures").json()
    answer = check(lasting, hand("up"), blurred(hand("up")), hand(None), b"nothing", name="wave")
    assert answer.status_code == 200
    body = answer.json()
    assert [image["accepted"] for image in body["images"]] == [True, False, False, False]
    problems = [image["problem"] for image in body["images"]]
    assert problems == [None, "blurred", "no_hand", "unreadable"]
    assert all(image["reason"] for image in body["images"][1:])
    assert body["accepted"] == 1
    assert body["left_out"] == {"blurred": 1, "no_hand": 1, "unreadable": 1}
    worst = body["confusions"][0]
    assert (worst["gesture"], worst["level"], worst["active"]) == ("up", "likely", True)
    assert worst["threshold"] == body["threshold"] > worst["distance"]
    assert {advice["code"] for advice in worst["advice"]} >= {"add_photos", "another_sign"}
    assert lasting.http.get("/api/gestures").json() == before


def test_more_samples_are_not_confused_with_their_own_gesture(server: Running, hand: Hand) -> None:
    up = next(g for g in server.http.get("/api/gestures").json() if g["name"] == "up")
    body = check(server, hand("up"), gesture=up["id"]).json()
    assert "up" not in [one["gesture"] for one in body["confusions"]]
    answer = server.http.post(f"/api/gestures/{up['id']}/samples", files=files((hand("up"),)))
    assert answer.status_code == 201
    assert "up" not in [one["gesture"] for one in answer.json()["confusions"]]
    assert check(server, hand("up"), gesture="nothing").status_code == 404


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"burst": "yes"}, "invalid"),
        ({"active": "1"}, "invalid"),
        ({"other": "x"}, "invalid"),
        ({"name": " "}, "invalid"),
        ({"action": '{"type": "dance"}'}, "bad_action"),
    ],
)
def test_a_bad_field_is_422(
    lasting: Running, hand: Hand, fields: dict[str, str], code: str
) -> None:
    answer = check(lasting, hand("up"), **fields)
    assert (answer.status_code, answer.json()["error"]["code"]) == (422, code)


def test_an_inactive_gesture_is_listed_and_not_matched_until_it_is_active(
    server: Running, hand: Hand
) -> None:
    for gesture in server.http.get("/api/gestures").json():
        assert gesture["active"] is True
        if gesture["name"] == "up":
            server.http.delete(f"/api/gestures/{gesture['id']}")
    answer = enrol(server, "wave", hand("up"), active="false")
    assert answer.status_code == 201
    wave = answer.json()
    assert wave["active"] is False
    assert "wave" in names(server)

    def recognised() -> dict[str, Any]:
        body: dict[str, Any] = server.http.post("/api/recognise", content=hand("up")).json()
        return body

    assert "wave" not in recognised()["distances"]
    path = f"/api/gestures/{wave['id']}"
    changed = server.http.patch(path, json={"active": True}).json()
    assert changed["active"] is True
    assert isinstance(changed["confusions"], list)
    assert recognised()["match"]["gesture"] == "wave"
    assert server.http.patch(path, json={"active": False}).json()["active"] is False
    assert "wave" not in recognised()["distances"]
    for wrong in ("yes", 1, None):
        assert server.http.patch(path, json={"active": wrong}).status_code == 422


def test_enrolling_says_what_may_be_confused(server: Running, hand: Hand) -> None:
    body = enrol(server, "wave", hand("left"), active="false").json()
    assert body["confusions"][0]["gesture"] == "left"
    (image,) = body["images"]
    assert image.pop("seen")["size"] == [640, 480]
    expected = {"image": 1, "accepted": True, "problem": None, "reason": None, "advice": []}
    assert image == {**expected, "sign": None}
    matrix = server.http.get("/api/gestures/confusions").json()
    listed = [gesture["name"] for gesture in matrix["gestures"]]
    assert listed == names(server)
    assert len(matrix["distances"]) == len(listed) == len(matrix["distances"][0])
    wave, left = listed.index("wave"), listed.index("left")
    assert matrix["distances"][wave][wave] is None
    assert matrix["distances"][wave][left] < matrix["threshold"]
    assert matrix["gestures"][wave]["own"] is None
    assert matrix["gestures"][wave]["active"] is False
    pairs = {(one["shown"], one["gesture"]) for one in matrix["confusions"]}
    assert ("wave", "left") in pairs
    # A change is seen at once.
    server.http.delete(f"/api/gestures/{body['id']}")
    after = server.http.get("/api/gestures/confusions").json()
    assert "wave" not in [gesture["name"] for gesture in after["gestures"]]


def test_a_burst_keeps_the_best_and_counts_the_rest(server: Running, hand: Hand) -> None:
    still = hand("home")
    frames = [still] * 40 + [blurred(still)] * 20 + [hand("home", 0.2)] * 5 + [hand("close")] * 3
    refused = enrol(server, "many", *frames)
    assert refused.status_code == 422
    body = enrol(server, "many", *frames, burst="true").json()
    burst = body["burst"]
    assert burst["images"] == len(frames)
    assert burst["left_out"]["blurred"] == 20
    assert burst["left_out"]["another_gesture"] == 3
    assert burst["left_out"]["near_duplicate"] >= 38
    assert body["samples"] == len(burst["kept"]) <= 8
    assert all(number <= 40 or 60 < number <= 65 for number in burst["kept"])
    assert len(burst["kept"]) + sum(burst["left_out"].values()) == len(frames)


def test_a_burst_without_a_good_frame_enrols_nothing(server: Running, hand: Hand) -> None:
    before = names(server)
    answer = enrol(server, "many", *[blurred(hand("up"))] * 3, hand(None), burst="true")
    error = answer.json()["error"]
    assert (answer.status_code, error["code"]) == (422, "image_refused")
    assert error["message"] == (
        "none of the 4 images of the burst can be enrolled: 3 blurred, 1 without a hand"
    )
    assert error["detail"] == {"images": 4, "left_out": {"blurred": 3, "no_hand": 1}}
    assert names(server) == before


def test_only_a_burst_may_be_large(server: Running, hand: Hand) -> None:
    up = next(g for g in server.http.get("/api/gestures").json() if g["name"] == "up")
    path = f"/api/gestures/{up['id']}/samples"
    image = hand("up") + bytes(1 << 20)
    five = files((image,) * 5)
    assert server.http.post(path, files=five).status_code == 413
    answer = server.http.post(path, files=five, data={"burst": "true"})
    assert answer.status_code == 201
    assert answer.json()["burst"]["left_out"] == {"near_duplicate": 4}
    assert server.http.post(path, files=five * 4, data={"burst": "true"}).status_code == 413
    many = files((hand("up"),) * 51)
    assert server.http.post(path, files=many).status_code == 422


SEEN = {"size", "landmarks", "handedness", "fingers", "mask_agrees", "region"}
needs_landmarks = pytest.mark.skipif(
    not wanted(PipelineSettings()), reason="needs the networks for hand landmarks"
)


@needs_landmarks
def test_what_was_seen_of_each_image_is_said(lasting: Running, hand: Hand) -> None:
    body = check(lasting, hand("up"), blurred(hand("up")), hand(None), b"nothing").json()
    good, bad, empty, broken = (image["seen"] for image in body["images"])
    recognised = lasting.http.post("/api/recognise", content=hand("up")).json()
    for seen in (good, bad, recognised["seen"]):
        assert set(seen) == SEEN
        assert seen["size"] == [640, 480]
        points = np.array(seen["landmarks"])
        assert points.shape == (21, 2)
        # The drawn hand's finger tip is above its wrist, in the middle of the picture.
        assert np.abs(points.mean(axis=0) - (320, 240)).max() < 100
        assert points[8, 1] < points[0, 1]
        assert seen["handedness"]["hand"] in ("left", "right", None)
        x, y, width, height = seen["region"]
        assert 0 <= x < x + width <= 640 and 0 <= y < y + height <= 480
        assert len(json.dumps(seen)) < 1000
    assert good["fingers"]["index"] is True
    assert good["fingers"]["ring"] is False
    assert good["mask_agrees"] is True
    nothing = dict.fromkeys(SEEN - {"size"}) | {"size": [640, 480]}
    assert empty == nothing
    assert broken is None
    none = lasting.http.post("/api/recognise", content=hand(None)).json()
    assert (none["match"], none["seen"]) == (None, nothing)


@needs_landmarks
def test_another_sign_than_the_one_asked_for_is_said_and_refused(
    lasting: Running, hand: Hand
) -> None:
    body = check(lasting, hand("up"), hand("forward"), hand("close"), sign="up").json()
    assert [image["accepted"] for image in body["images"]] == [True, False, False]
    assert body["left_out"] == {"not_the_sign": 2}
    fits, two, fist = (image["sign"] for image in body["images"])
    assert fits is None
    asked = {"seen": 2, "asked": 1, "stretch": [], "bend": ["middle"]}
    assert two == {"code": "count", **asked}
    assert body["images"][1]["reason"] == "that is two fingers: one finger is asked"
    assert fist["code"] == "palm_only"
    # Nothing is asked, nothing is compared.
    plain = check(lasting, hand("forward")).json()["images"][0]
    assert (plain["accepted"], plain["sign"]) == (True, None)

    before = names(lasting)
    error = enrol(lasting, "wave", hand("up"), hand("forward"), sign="up").json()["error"]
    assert (error["code"], error["detail"]["image"]) == ("image_refused", 2)
    assert error["detail"]["problem"] == "not_the_sign"
    assert error["detail"]["sign"] == two
    error = enrol(lasting, "wave", hand("forward"), sign="up", burst="true").json()["error"]
    assert error["detail"]["left_out"] == {"not_the_sign": 1}
    assert error["message"].endswith("1 of another sign")
    wrong = check(lasting, hand("up"), sign="dance")
    assert (wrong.status_code, wrong.json()["error"]["detail"]) == (422, {"field": "sign"})
    assert names(lasting) == before
