"""The gesture database over REST."""

import json
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from tests.gateway.running import Running

Hand = Callable[..., bytes]
JOG = {"type": "jog_joint", "joint": 2, "velocity": 0.3}


def enrol(
    server: Running, name: str, action: Any, *images: bytes, field: str = "images"
) -> httpx.Response:
    text = action if isinstance(action, str) else json.dumps(action)
    files = [(field, (f"{n}.jpg", image, "image/jpeg")) for n, image in enumerate(images)]
    return server.http.post("/api/gestures", data={"name": name, "action": text}, files=files)


def error(answer: httpx.Response, status: int, code: str) -> str:
    """The message of an error answer, once its shape is checked."""
    body = answer.json()
    assert answer.status_code == status, body
    assert body.keys() == {"error"}
    assert body["error"].keys() == {"code", "message", "detail"}
    assert body["error"]["code"] == code
    assert isinstance(body["error"]["detail"], dict)
    return str(body["error"]["message"])


def names(server: Running) -> list[str]:
    return [gesture["name"] for gesture in server.http.get("/api/gestures").json()]


def test_the_starter_set_is_there(lasting: Running) -> None:
    gestures = lasting.http.get("/api/gestures").json()
    assert len(gestures) == 10
    forward = next(gesture for gesture in gestures if gesture["name"] == "forward")
    assert forward["action"] == {
        "type": "jog_cartesian",
        "frame": "base",
        "linear": [0.1, 0.0, 0.0],
        "angular": [0.0, 0.0, 0.0],
    }
    assert forward["samples"] == len(forward["sample_ids"]) == 2
    assert lasting.http.get(f"/api/gestures/{forward['id']}").json() == forward


def test_one_image_enrols_a_gesture_that_is_recognised_at_once(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        for gesture in server.http.get("/api/gestures").json():
            assert server.http.delete(f"/api/gestures/{gesture['id']}").status_code == 204
        assert names(server) == []
        answer = enrol(server, "wave", JOG, hand("forward"))
        assert answer.status_code == 201
        gesture = answer.json()
        assert answer.headers["location"] == f"/api/gestures/{gesture['id']}"
        assert (gesture["name"], gesture["samples"]) == ("wave", 1)
        assert gesture["action"] == JOG
        found = server.http.post("/api/recognise", files={"image": hand("forward")}).json()
        assert found["match"]["gesture"] == "wave"
        assert found["reason"] is None
        operator.next("gallery")


def test_samples_are_added_and_shown(server: Running, hand: Hand) -> None:
    gesture = enrol(server, "wave", JOG, hand("forward"), hand("up")).json()
    path = f"/api/gestures/{gesture['id']}"
    more = server.http.post(f"{path}/samples", files=[("images", hand("left"))])
    assert more.status_code == 201
    assert more.json()["samples"] == 3
    for sample in range(3):
        png = server.http.get(f"{path}/template.png", params={"sample": sample})
        assert png.headers["content-type"] == "image/png"
        picture = cv2.imdecode(np.frombuffer(png.content, np.uint8), cv2.IMREAD_GRAYSCALE)
        assert picture is not None
        assert picture.shape == (80, 60)
        assert set(np.unique(picture)) == {0, 255}
    message = error(server.http.get(f"{path}/template.png", params={"sample": 3}), 404, "not_found")
    assert message == "wave has 3 samples, counted from 0; there is no number 3"
    error(server.http.get(f"{path}/template.png", params={"sample": -1}), 422, "invalid")
    error(server.http.get(f"{path}/template.png", params={"sample": "x"}), 422, "invalid")


def test_name_and_action_are_changed(server: Running, hand: Hand) -> None:
    gesture = enrol(server, "wave", JOG, hand("forward")).json()
    path = f"/api/gestures/{gesture['id']}"
    assert server.http.patch(path, json={"name": "hello"}).json()["name"] == "hello"
    changed = server.http.patch(path, json={"action": {"type": "home"}}).json()
    assert (changed["name"], changed["action"]) == ("hello", {"type": "home"})
    assert changed["id"] == gesture["id"]


def test_a_duplicate_name_is_refused(server: Running, hand: Hand) -> None:
    message = error(enrol(server, "FORWARD", JOG, hand("up")), 409, "duplicate")
    assert "forward" in message.lower()
    gesture = enrol(server, "wave", JOG, hand("up")).json()
    error(
        server.http.patch(f"/api/gestures/{gesture['id']}", json={"name": "back"}), 409, "duplicate"
    )


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", ""),
        ("PATCH", ""),
        ("DELETE", ""),
        ("POST", "/samples"),
        ("GET", "/template.png"),
    ],
)
def test_an_unknown_id_is_404(lasting: Running, hand: Hand, method: str, path: str) -> None:
    arguments: dict[str, Any] = {}
    if method == "PATCH":
        arguments["json"] = {"name": "x"}
    if method == "POST":
        arguments["files"] = [("images", hand("up"))]
    error(
        lasting.http.request(method, f"/api/gestures/nothing{path}", **arguments), 404, "not_found"
    )


BAD_ACTIONS: dict[str, Any] = {
    "not JSON": "{home}",
    "NaN": '{"type": "turn_joint", "joint": 1, "angle": NaN}',
    "infinite": '{"type": "turn_joint", "joint": 1, "angle": 1e999}',
    "a list": [],
    "no type": {},
    "unknown type": {"type": "dance"},
    "joint 17": {"type": "jog_joint", "joint": 17, "velocity": 0.1},
    "too fast": {"type": "jog_joint", "joint": 1, "velocity": 100},
    "unknown field": {"type": "home", "now": True},
    "two numbers": {"type": "jog_cartesian", "linear": [1, 2]},
    "endless step": {"type": "sequence", "steps": [JOG]},
    "no steps": {"type": "sequence", "steps": []},
    "deep": "[" * 5000 + "]" * 5000,
}


@pytest.mark.parametrize("what", BAD_ACTIONS)
def test_a_bad_action_is_422_and_enrols_nothing(lasting: Running, hand: Hand, what: str) -> None:
    before = names(lasting)
    answer = enrol(lasting, "wave", BAD_ACTIONS[what], hand("up"))
    assert answer.status_code == 422
    assert answer.json()["error"]["code"] in ("bad_action", "invalid")
    assert names(lasting) == before


@pytest.mark.parametrize("name", ["", "   ", "x" * 61, "a\x00b", "tab\tname"])
def test_a_bad_name_is_422(lasting: Running, hand: Hand, name: str) -> None:
    error(enrol(lasting, name, JOG, hand("up")), 422, "invalid")


def test_an_image_without_a_hand_is_422_with_the_reason(lasting: Running, hand: Hand) -> None:
    before = names(lasting)
    message = error(enrol(lasting, "wave", JOG, hand(None)), 422, "image_refused")
    assert "no hand" in message
    # Whole or not at all: the good one before it is not kept either.
    message = error(enrol(lasting, "wave", JOG, hand("up"), hand(None)), 422, "image_refused")
    assert message.startswith("image 2: ")
    assert names(lasting) == before


@pytest.mark.parametrize("image", [b"", b"hello", b"\xff\xd8\xff\xe0" + bytes(200)])
def test_what_is_no_image_is_422(lasting: Running, image: bytes) -> None:
    assert enrol(lasting, "wave", JOG, image).status_code == 422
    code = "image_refused" if image else "invalid"
    error(lasting.http.post("/api/recognise", content=image), 422, code)


def test_fields_that_are_missing_or_wrong_are_422(lasting: Running, hand: Hand) -> None:
    post = lasting.http.post
    image = ("images", ("a.jpg", hand("up"), "image/jpeg"))
    home = '{"type": "home"}'
    error(post("/api/gestures", data={"action": home}, files=[image]), 422, "invalid")
    error(post("/api/gestures", data={"name": "x"}, files=[image]), 422, "invalid")
    error(
        post(
            "/api/gestures",
            data={"name": "x", "action": home, "images": "x"},
            files=[("other", b"x")],
        ),
        422,
        "invalid",
    )
    error(
        post("/api/gestures", data={"name": ["x", "y"], "action": home}, files=[image]),
        422,
        "invalid",
    )
    error(enrol(lasting, "x", JOG), 415, "unsupported_media_type")
    error(enrol(lasting, "x", JOG, hand("up"), field="pictures"), 422, "invalid")
    error(post("/api/gestures", json={"name": "x"}), 415, "unsupported_media_type")
    error(
        post("/api/gestures", content=b"no parts", headers={"Content-Type": "multipart/form-data"}),
        400,
        "bad_request",
    )


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b"{}", b'{"name": 5}', b'{"id": "x"}', b'{"name": NaN}', b'"x"']
)
def test_a_bad_change_is_422(lasting: Running, body: bytes) -> None:
    id = lasting.http.get("/api/gestures").json()[0]["id"]
    answer = lasting.http.patch(
        f"/api/gestures/{id}", content=body, headers={"Content-Type": "application/json"}
    )
    error(answer, 422, "invalid")
    error(lasting.http.patch(f"/api/gestures/{id}", content=b"{}"), 415, "unsupported_media_type")


def test_over_four_mebibytes_is_413(lasting: Running, hand: Hand) -> None:
    big = hand("up") + bytes((4 << 20) + 1)
    error(enrol(lasting, "wave", JOG, big), 413, "too_large")
    half = hand("up") + bytes(5 << 19)
    error(enrol(lasting, "wave", JOG, half, half), 413, "too_large")
    error(lasting.http.post("/api/recognise", content=big), 413, "too_large")
    error(lasting.http.post("/api/recognise", files={"image": big}), 413, "too_large")
    id = lasting.http.get("/api/gestures").json()[0]["id"]
    error(
        lasting.http.post(f"/api/gestures/{id}/samples", files=[("images", big)]), 413, "too_large"
    )
    assert "wave" not in names(lasting)


def test_an_endless_upload_is_refused_while_it_streams(lasting: Running) -> None:
    sent = 0

    def endless() -> Iterator[bytes]:
        nonlocal sent
        while sent < 64 << 20:
            sent += 1 << 16
            yield bytes(1 << 16)

    answer = lasting.http.post("/api/recognise", content=endless())
    error(answer, 413, "too_large")


def test_recognise_takes_a_body_or_a_field(lasting: Running, hand: Hand) -> None:
    body = lasting.http.post("/api/recognise", content=hand("left")).json()
    field = lasting.http.post("/api/recognise", files={"image": hand("left")}).json()
    typed = lasting.http.post(
        "/api/recognise", content=hand("left"), headers={"Content-Type": "image/jpeg"}
    ).json()
    assert body == field == typed
    assert body["match"]["gesture"] == "left"
    assert body["match"].keys() == {"gesture", "distance", "margin"}
    assert len(body["distances"]) == 10
    nothing = lasting.http.post("/api/recognise", content=hand(None)).json()
    assert nothing["match"] is None
    assert "no hand" in nothing["reason"]
    error(lasting.http.post("/api/recognise"), 422, "invalid")
    error(lasting.http.post("/api/recognise", json={}), 415, "unsupported_media_type")
    error(
        lasting.http.post("/api/recognise", files=[("image", b"a"), ("image", b"b")]),
        422,
        "invalid",
    )


def test_unknown_routes_and_methods_have_the_same_shape(lasting: Running) -> None:
    assert error(lasting.http.get("/api/nothing"), 404, "not_found") == (
        "there is nothing at /api/nothing"
    )
    assert error(lasting.http.put("/api/gestures"), 405, "method_not_allowed") == (
        "PUT is not possible at /api/gestures"
    )
    error(lasting.http.get("/static/../config.py"), 404, "not_found")
    error(lasting.http.get("/static/%2e%2e/config.py"), 404, "not_found")
    error(lasting.http.get("/static/"), 404, "not_found")


def test_what_goes_wrong_inside_is_not_told(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_gallery: str) -> None:
        raise RuntimeError("secret detail")

    monkeypatch.setattr(server.hub.store, "list", broken)
    answer = server.http.get("/api/gestures")
    assert error(answer, 500, "internal") == (
        "something went wrong inside the server; its log says what"
    )
    assert "secret" not in answer.text
    assert answer.headers["x-content-type-options"] == "nosniff"
