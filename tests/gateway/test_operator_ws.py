"""The operator WebSocket, spoken to as any client would."""

import base64
import json
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from app.gateway.frame_job import FrameDone, FrameJob, FrameWorker
from app.gateway.lease_keeper import RENEW_S, SILENT_S
from app.link.header import FrameHeader
from app.link.messages import COMMAND_TTL_MS
from tests.gateway.running import Operator, Running, StandIn, running, settings_for, wait_for

Hand = Callable[..., bytes]


def take_and_arm(operator: Operator) -> None:
    operator.send("take_control")
    operator.next("robot", controller=operator.hello["session"])
    operator.send("arm")
    operator.next("robot", mode="armed")


def rest(operator: Operator, jpeg: bytes, frames: int = 4) -> None:
    for _ in range(frames):
        operator.show(jpeg)
        time.sleep(0.03)


def show_until(
    operator: Operator, jpeg: bytes, condition: Callable[[dict], bool], timeout_s: float = 10.0
) -> dict:
    """Show a picture as a webcam would until a frame message satisfies the condition."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        message = operator.show(jpeg)
        if condition(message):
            return message
        time.sleep(0.03)
    raise AssertionError(f"last frame message: {message}")


def close_code(operator: Operator) -> int:
    """Read until the server closes, and return its code."""
    try:
        while True:
            operator.receive()
    except ConnectionClosed as error:
        assert error.rcvd is not None, "the connection broke without a close code"
        return error.rcvd.code


def test_hello_comes_first_and_names_the_session(server: Running) -> None:
    with server.operator() as operator:
        hello = operator.hello
    assert hello["role"] == "operator"
    assert hello["robot"] == "puma"
    assert hello["session"].startswith("operator-")
    assert hello["tick"] > 0
    assert hello["limits"]["frame_bytes"] == 256 * 1024
    assert hello["limits"]["message_bytes"] == 1 << 20


def test_robot_messages_come_more_than_ten_times_a_second(server: Running) -> None:
    with server.operator() as operator:
        first = operator.next("robot")
        started = time.monotonic()
        for _ in range(20):
            operator.next("robot")
        assert time.monotonic() - started < 2.0
    assert first["joints"] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert first["mode"] == "disarmed"
    assert first["armed"] is False
    assert first["controller"] is None
    assert first["fault"] is None
    assert first["online"] is True


def test_a_frame_is_answered(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        message = operator.show(hand(None))
    assert {"seq", "tick", "motion", "still", "roi", "match", "reason", "timing_ms"} <= set(message)
    assert message["seq"] == 1
    assert message["match"] is None
    assert message["reason"]
    assert message["timing_ms"]["total"] > 0


def test_a_shown_gesture_starts_holds_and_ends(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        shown = show_until(operator, hand("forward"), lambda frame: frame["gesture"] is not None)
        assert shown["match"]["gesture"] == "forward"
        start = operator.next("gesture", phase="start")
        assert start["gesture"] == "forward"
        show_until(operator, hand(None), lambda frame: frame["gesture"] is None)
        end = operator.next("gesture", phase="end")
        assert end["gesture"] == "forward"


def test_a_gesture_ends_when_frames_stop_coming(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        show_until(operator, hand("up"), lambda frame: frame["gesture"] is not None)
        assert operator.next("gesture", phase="end", timeout_s=3)["gesture"] == "up"


def test_a_held_gesture_commands_the_robot(server: Running, node: StandIn, hand: Hand) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        rest(operator, hand(None))
        assert node.commands[-1].action is None
        frame = show_until(operator, hand("left"), lambda frame: frame["gesture"] is not None)
        assert frame["reason"] is None
        command = wait_for(lambda: node.commands[-1].action and node.commands[-1], "an action")
        assert command.action.type == "jog_cartesian"
        assert command.action.linear == (0.0, 0.1, 0.0)
        assert command.gesture == "left"
        assert command.epoch == node.epoch
        assert command.ttl_ms <= COMMAND_TTL_MS
        hold = command.hold
        sequences = [each.sequence for each in node.commands]
        assert sequences == sorted(set(sequences))
        seen = operator.next("robot", seq=node.commands[-1].frame)
        assert seen["controller"] == operator.hello["session"]
        # Another showing has another number.
        show_until(operator, hand(None), lambda frame: frame["gesture"] is None)
        show_until(operator, hand("left"), lambda frame: frame["gesture"] is not None)
        again = wait_for(lambda: node.commands[-1].action and node.commands[-1], "an action")
        assert again.hold > hold


def test_without_control_nothing_is_commanded_and_the_reason_says_so(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        frame = show_until(operator, hand("left"), lambda frame: frame["gesture"] is not None)
        assert frame["reason"] == "nobody has control: take control first"
        with server.operator() as other:
            take_and_arm(other)
            reason = f"you do not have control: {other.hello['session']} drives"
            show_until(operator, hand("left"), lambda frame: frame["reason"] == reason)
    assert [command for command in node.commands if command.action] == []


def test_a_gesture_shown_before_arming_moves_nothing(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        operator.send("take_control")
        operator.next("robot", controller=operator.hello["session"])
        rest(operator, hand(None))
        frame = show_until(operator, hand("left"), lambda frame: frame["gesture"] is not None)
        assert frame["reason"] == "the robot is not armed"
        operator.send("arm")
        operator.next("robot", mode="armed")
        frame = operator.show(hand("left"))
        assert frame["gesture"] == "left"
        assert "let go and show it again" in frame["reason"]
    assert [command for command in node.commands if command.action] == []


def test_the_stop_gesture_stops_without_control(server: Running, node: StandIn, hand: Hand) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        show_until(operator, hand("stop"), lambda frame: frame["gesture"] == "stop")
        stop = wait_for(lambda: node.stops and node.stops[0], "a stop")
        assert stop.category == "S1"
        assert stop.source == operator.hello["session"]
        operator.next("robot", mode="stopped")


def test_a_stale_frame_moves_nothing_and_says_so(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        rest(operator, hand(None))
        time.sleep(0.6)
        operator.next("robot")
        old = operator.tick - 2000
        operator.frame(hand(None), tick=max(0, old))
        before = len(node.commands)
        message = operator.next("frame", seq=operator.seq)
        assert "too old to move the robot" in message["reason"]
        time.sleep(0.1)
        assert len(node.commands) == before
        operator.frame(hand(None), tick=operator.tick + 60_000)
        message = operator.next("frame", seq=operator.seq)
        assert "has not come yet" in message["reason"]


def test_frames_out_of_order_are_ignored(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        operator.frame(hand(None), seq=10)
        operator.next("frame", seq=10)
        operator.frame(hand(None), seq=9)
        operator.frame(hand(None), seq=10)
        operator.frame(hand(None), seq=11)
        assert operator.next("frame")["seq"] == 11


def test_sequence_numbers_may_wrap(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        operator.frame(hand(None), seq=2**32 - 1)
        operator.next("frame", seq=2**32 - 1)
        operator.frame(hand(None), seq=0)
        operator.next("frame", seq=0)


def test_the_newest_frame_wins(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        for _ in range(60):
            operator.frame(hand("forward"))
        answered = []
        while not answered or answered[-1] != 60:
            answered.append(operator.next("frame")["seq"])
        assert answered == sorted(set(answered))
        replaced = server.hub.metrics.frames.labels("replaced")._value.get()
        processed = server.hub.metrics.frames.labels("processed")._value.get()
        assert replaced + processed == 60
        assert replaced > 0


# Bad input


def progressive() -> bytes:
    picture = np.zeros((240, 320, 3), np.uint8)
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])
    assert done
    return data.tobytes()


def large_picture(width: int, height: int) -> bytes:
    done, data = cv2.imencode(".jpg", np.zeros((height, width, 3), np.uint8))
    assert done
    return data.tobytes()


def heavy() -> bytes:
    """A good JPEG of 1280x720 with more than 256 KiB."""
    noise = np.random.default_rng(1).integers(0, 256, (720, 1280, 3), np.uint8)
    done, data = cv2.imencode(".jpg", noise, [cv2.IMWRITE_JPEG_QUALITY, 90])
    assert done
    assert 256 * 1024 < len(data) < 1 << 20
    return data.tobytes()


HEADER = FrameHeader(5, 1.0, 0).pack()
BAD_FRAMES = {
    "nothing": (b"", "header_short", None),
    "short header": (HEADER[:23], "header_short", None),
    "wrong magic": (b"XX" + HEADER[2:] + b"x", "header_magic", None),
    "wrong version": (b"FH\x02" + HEADER[3:] + b"x", "header_version", None),
    "time is NaN": (
        struct.pack("<2sBBIdQ", b"FH", 1, 0, 5, float("nan"), 0) + b"x",
        "header_time",
        None,
    ),
    "no picture": (HEADER, "frame_empty", 5),
    "no JPEG": (HEADER + b"GIF89a" + bytes(100), "frame_not_jpeg", 5),
    "progressive": (HEADER + progressive(), "frame_not_baseline", 5),
    "too wide": (HEADER + large_picture(1281, 720), "frame_too_large", 5),
    "too high": (HEADER + large_picture(1280, 721), "frame_too_large", 5),
    "too heavy": (HEADER + heavy(), "frame_too_large", 5),
    "cut short": (HEADER + large_picture(320, 240)[:-40], "frame_cut_short", 5),
}


@pytest.mark.parametrize("what", BAD_FRAMES)
def test_a_bad_frame_is_told_and_survived(server: Running, hand: Hand, what: str) -> None:
    message, code, seq = BAD_FRAMES[what]
    with server.operator() as operator:
        operator.socket.send(message)
        error = operator.next("error")
        assert error["code"] == code
        assert error["seq"] == seq
        assert error["message"]
        operator.frame(hand(None), seq=6)
        operator.next("frame", seq=6)


BAD_TEXTS = {
    "not JSON": ("hello", "message_not_json"),
    "NaN": ('{"type": "ping", "t": NaN}', "message_not_json"),
    "infinity": ('{"type": "ping", "t": -Infinity}', "message_not_json"),
    "too large a number": ('{"type": "ping", "t": 1e999}', "message_values"),
    "NaN beside": ('{"type": "arm", "x": NaN}', "message_not_json"),
    "a list": ("[]", "message_not_object"),
    "deep": ("[" * 3000 + "]" * 1000, "message_not_json"),
    "no type": ("{}", "message_type"),
    "unknown type": ('{"type": "fly"}', "message_type"),
    "type is a list": ('{"type": ["arm"]}', "message_type"),
    "unknown field": ('{"type": "arm", "now": true}', "message_values"),
    "wrong kind": ('{"type": "view", "detail": "perhaps"}', "message_values"),
    "long": (json.dumps({"type": "ping", "t": 1, "x": "y" * 5000}), "message_too_long"),
}


@pytest.mark.parametrize("what", BAD_TEXTS)
def test_a_bad_text_is_told_and_survived(server: Running, what: str) -> None:
    text, code = BAD_TEXTS[what]
    with server.operator() as operator:
        operator.socket.send(text)
        error = operator.next("error")
        assert error["code"] == code
        assert error["seq"] is None
        operator.send("ping", t=7.5)
        pong = operator.next("pong")
        assert pong["t"] == 7.5
        assert pong["tick"] >= operator.hello["tick"]


def test_ten_bad_messages_in_a_row_close_the_session(server: Running) -> None:
    with server.operator() as operator:
        for _ in range(5):
            operator.socket.send(HEADER + b"no JPEG")
            operator.socket.send("{}")
        errors = 0
        try:
            while True:
                errors += operator.receive()["type"] == "error"
        except ConnectionClosed as closed:
            assert closed.rcvd is not None
            assert closed.rcvd.code == 1007
        assert errors == 10


def test_a_good_message_in_between_forgives(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        for _ in range(3):
            for _ in range(9):
                operator.socket.send("{}")
            operator.show(hand(None))
        operator.send("ping", t=1)
        operator.next("pong")


@pytest.mark.parametrize("size", [(1 << 20) + 1, 5 << 20])
def test_a_message_over_the_limit_closes_with_1009(server: Running, size: int) -> None:
    with server.operator() as operator:
        operator.socket.send(HEADER + bytes(size - len(HEADER)))
        assert close_code(operator) == 1009


def test_a_long_text_over_the_limit_closes_with_1009(server: Running) -> None:
    with server.operator() as operator:
        operator.socket.send("x" * ((1 << 20) + 1))
        assert close_code(operator) == 1009


def test_a_message_of_exactly_the_limit_is_only_refused(server: Running) -> None:
    with server.operator() as operator:
        operator.socket.send(HEADER + bytes((1 << 20) - len(HEADER)))
        assert operator.next("error")["code"] == "frame_too_large"


# Control


def test_control_is_taken_kept_and_given_back(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        operator.send("take_control")
        operator.next("robot", controller=operator.hello["session"])
        wait_for(lambda: [r for r in node.requests if r.kind == "renew"], "a renewal", 3)
        operator.send("release_control")
        operator.next("robot", controller=None)


def test_requests_without_control_are_refused(server: Running) -> None:
    with server.operator() as operator:
        for request in ("arm", "disarm", "release_control"):
            operator.send(request)
            error = operator.next("error")
            assert error["code"] == "no_control"
            assert "take control first" in error["message"]


def test_control_is_refused_while_another_drives_and_may_be_taken_over(server: Running) -> None:
    with server.operator() as first, server.operator() as second:
        first.send("take_control")
        first.next("robot", controller=first.hello["session"])
        second.send("take_control")
        error = second.next("error")
        assert error["code"] == "no_control"
        assert first.hello["session"] in error["message"]
        second.send("take_control", takeover=True)
        second.next("robot", controller=second.hello["session"])
        assert first.next("error")["code"] == "control_lost"
        first.send("arm")
        assert first.next("error")["code"] == "no_control"


def test_who_drives_and_falls_silent_loses_control(server: Running, node: StandIn) -> None:
    # As on a link that swallows everything: the connection stays open.
    with server.operator() as operator:
        take_and_arm(operator)
        heard = time.monotonic()
        while time.monotonic() < heard + SILENT_S + 2 * RENEW_S:
            operator.send("ping", t=1)
            operator.next("pong")
            time.sleep(0.1)
        assert node.holder == operator.hello["session"]
        assert "control is lost" in operator.next("error", code="control_lost")["message"]
        assert node.holder is None


def test_the_lease_is_given_back_when_the_browser_goes(server: Running, node: StandIn) -> None:
    operator = server.operator()
    operator.send("take_control")
    operator.next("robot", controller=operator.hello["session"])
    operator.socket.socket.close()
    wait_for(lambda: node.holder is None, "the lease to be free", 3)


def test_anybody_stops_and_resets(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        operator.send("stop")
        operator.next("robot", mode="stopped")
        assert node.stops[0].source == operator.hello["session"]
        operator.send("reset")
        operator.next("robot", mode="disarmed")


def test_what_the_robot_refuses_is_told_with_its_code(server: Running) -> None:
    with server.operator() as operator:
        operator.send("take_control")
        operator.send("stop")
        operator.next("robot", mode="stopped")
        operator.send("arm")
        error = operator.next("error")
        assert (error["code"], error["message"]) == ("stopped", "reset it first")


def test_a_silent_robot_is_shown_and_its_requests_fail(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        operator.next("robot", online=True)
        node.silent = True
        since = time.monotonic()
        gone = operator.next("robot", online=False)
        assert time.monotonic() - since < 0.6
        assert gone["mode"] == "faulted"
        assert gone["fault"].startswith("no word from the robot for ")
        assert gone["joints"] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
        operator.send("take_control")
        assert operator.next("error")["code"] == "robot_unavailable"
        operator.send("stop")
        error = operator.next("error")
        assert error["code"] == "robot_unavailable"
        assert "sent but not confirmed" in error["message"]
        node.silent = False
        operator.next("robot", mode="stopped")


def test_a_stop_does_not_wait_for_a_request_that_hangs(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        operator.send("take_control")
        operator.next("robot", controller=operator.hello["session"])
        node.silent = True
        for _ in range(5):
            operator.send("arm")
        operator.send("stop")
        time.sleep(0.05)
        node.silent = False
        operator.next("robot", mode="stopped", timeout_s=2)


def test_many_stops_at_once_are_one(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        node.silent = True
        for _ in range(100):
            operator.send("stop")
        operator.send("ping", t=1.0)
        operator.next("pong")
        counted = server.hub.metrics.stops.labels("button")._value.get()
        assert 1 <= counted < 50
        node.silent = False
        operator.next("robot", mode="stopped")


def test_a_stop_gesture_counts_although_the_browser_goes_at_once(
    server: Running, node: StandIn, hand: Hand, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, go_on = threading.Event(), threading.Event()
    run = FrameWorker.run

    def slow(worker: FrameWorker, job: FrameJob) -> FrameDone:
        done = run(worker, job)
        if done.decision.stop is not None:
            seen.set()
            go_on.wait(10)
        return done

    monkeypatch.setattr(FrameWorker, "run", slow)
    with server.operator() as operator:
        rest(operator, hand(None))
        while not seen.wait(0.03):
            operator.frame(hand("stop"))
    try:
        wait_for(lambda: not server.hub.people.sessions, "the session to end")
    finally:
        go_on.set()
    wait_for(lambda: node.stops, "the stop")


def test_a_detail_view_brings_masks_and_distances(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        assert "detail" not in operator.show(hand("home"))
        operator.send("view", detail=True)
        frame = show_until(
            operator, hand("home"), lambda frame: "detail" in frame and frame["match"]
        )
        detail = frame["detail"]
        assert set(detail) == {"mask", "template", "distances", "threshold", "wrist"}, (
            "what lies between comes only for who asks"
        )
        assert detail["distances"]["home"] < detail["threshold"]
        template = decode(detail["template"])
        assert template.shape == (80, 60)
        assert set(np.unique(template)) == {0, 255}
        assert decode(detail["mask"]).shape[1] == 160
        operator.send("view", detail=False)
        operator.send("ping", t=0)
        operator.next("pong")
        assert "detail" not in operator.show(hand("home"))


def test_the_glass_box_gets_every_step_between(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        operator.send("view", detail=True, glass=True)
        frame = show_until(
            operator, hand("home"), lambda frame: "detail" in frame and frame["match"]
        )
        glass = frame["detail"]["glass"]
        assert decode(glass["mismatch"]).shape == decode(frame["detail"]["mask"]).shape
        assert frame["motion"] < glass["motion_limit"]
        # The palm is in the box; the histogram is that of the mask, with its maximum at the palm.
        x, y, width, height = frame["roi"]
        assert x < glass["palm"]["x"] < x + width
        assert y < glass["palm"]["y"] < y + height
        assert glass["histogram"]["axis"] == "y"
        assert frame["detail"]["wrist"]["side"] == "bottom"
        mask = decode(frame["detail"]["mask"]) > 0
        assert np.mean(glass["histogram"]["shares"]) == pytest.approx(mask.mean(), abs=0.02)

        gestures = {g["id"]: g for g in server.http.get("/api/gestures").json()}
        nearest = glass["nearest"]
        assert len(nearest) == 5
        assert [each["distance"] for each in nearest] == sorted(e["distance"] for e in nearest)
        for each in nearest:
            assert gestures[each["id"]]["name"] == each["gesture"]
            assert 0 <= each["sample"] < gestures[each["id"]]["samples"]
        # It is that sample, and no other: as the server draws it.
        best = nearest[0]
        url = f"/api/gestures/{best['id']}/template.png?sample={best['sample']}"
        drawn = cv2.imdecode(
            np.frombuffer(server.http.get(url).content, np.uint8), cv2.IMREAD_GRAYSCALE
        )
        assert drawn is not None
        assert np.mean((drawn > 0) == (decode(frame["detail"]["template"]) > 0)) > 0.9

        answer = glass["answer"]
        distances = frame["detail"]["distances"]
        first, second = sorted(distances, key=distances.__getitem__)[:2]
        assert (answer["gesture"], answer["second"], answer["accepted"]) == (first, second, True)
        assert answer["margin"] == pytest.approx(distances[second] - distances[first], abs=2e-4)
        assert answer["margin"] > answer["min_margin"]

        projection = glass["projection"]
        assert sorted(projection["gestures"]) == sorted(distances)
        assert len(projection["templates"]) == sum(g["samples"] for g in gestures.values())
        places = np.array([template[1:] for template in projection["templates"]])
        nearest = np.linalg.norm(places - projection["query"], axis=1).argmin()
        assert projection["gestures"][projection["templates"][nearest][0]] == "home"
        assert 0 < sum(projection["share"]) < 1

        operator.send("view", detail=True)
        operator.send("ping", t=0)
        operator.next("pong")
        frame = show_until(operator, hand("home"), lambda frame: "detail" in frame)
        assert "glass" not in frame["detail"]


def test_the_glass_box_of_an_empty_room_shows_that_nothing_is_there(
    server: Running, hand: Hand
) -> None:
    with server.operator() as operator:
        operator.send("view", detail=True, glass=True)
        frame = show_until(
            operator, hand(None), lambda frame: "detail" in frame and frame["motion"] is not None
        )
        assert frame["cause"] == "no_hand"
        glass = frame["detail"]["glass"]
        assert not decode(glass["mismatch"]).any()
        assert (glass["palm"], glass["histogram"], glass["nearest"]) == (None, None, [])
        assert (glass["answer"], glass["projection"]["query"]) == (None, None)
        assert glass["projection"]["templates"]


def decode(png: str) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return picture


def test_a_change_of_the_gallery_is_told(server: Running) -> None:
    with server.operator() as operator:
        gesture = server.http.get("/api/gestures").json()[0]
        changed = server.http.patch(f"/api/gestures/{gesture['id']}", json={"name": "renamed"})
        assert changed.status_code == 200
        assert operator.next("gallery")["version"] > operator.hello["gallery"]


def test_a_slow_browser_loses_messages_and_slows_nobody(server: Running, hand: Hand) -> None:
    with server.operator(max_queue=1) as slow, server.operator() as quick:
        slow.send("view", detail=True)
        for _ in range(30):
            slow.frame(hand("forward"))  # and reads nothing
            quick.show(hand("forward"))
        started = time.monotonic()
        for _ in range(10):
            quick.next("robot")
        assert time.monotonic() - started < 1.5


def test_too_many_sessions_are_turned_away(node: StandIn, folder: Path) -> None:
    with running(settings_for(folder, node.endpoint, max_sessions=1)) as server:
        with server.operator():
            with pytest.raises(ConnectionClosed) as closed:
                server.operator()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert "1 operator is here already" in closed.value.rcvd.reason
        wait_for(lambda: not server.hub.people.sessions, "the session to be over")
        server.operator().close()


def noisy(jpeg: bytes, seed: int) -> bytes:
    """The picture as another frame of a real sensor would give it."""
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    noise = np.random.default_rng(seed).normal(0, 1.5, picture.shape)
    noised = np.clip(picture + noise, 0, 255).astype(np.uint8)
    return cv2.imencode(".jpg", noised, [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()


def test_a_webcam_that_freezes_moves_nothing_any_more(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        nothing, shown = ([noisy(hand(what), n) for n in range(6)] for what in (None, "forward"))
        for n in range(15):
            operator.show(nothing[n % 6])
            time.sleep(0.02)
        for n in range(200):
            if operator.show(shown[n % 6])["gesture"] == "forward":
                break
            time.sleep(0.02)
        message = show_until(operator, shown[0], lambda frame: frame["doubt"] == "frozen")
        assert message["gesture"] == "forward"
        assert message["reason"] == "the webcam picture is frozen"
        command = wait_for(lambda: node.commands[-1].doubt == "frozen" and node.commands[-1], "")
        assert (command.action, command.gesture) == (None, "forward")
        # A hand that is gone from a living picture is told as such.
        show_until(operator, hand(None), lambda frame: frame["doubt"] == "no_hand")
        wait_for(lambda: node.commands[-1].doubt == "no_hand", "the reason at the robot")


def test_one_picture_shown_again_and_again_is_no_frozen_webcam(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        rest(operator, hand(None))
        show_until(operator, hand("forward"), lambda frame: frame["gesture"] == "forward")
        began = time.monotonic()
        while time.monotonic() - began < 0.8:
            assert operator.show(hand("forward"))["doubt"] is None
            time.sleep(0.03)
        wait_for(lambda: node.commands[-1].action is not None, "the action")


def test_who_sees_an_old_picture_of_the_robot_moves_nothing(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        rest(operator, hand(None))
        operator.send("picture", camera="wrist", tick=node.state().tick)
        show_until(operator, hand("forward"), lambda frame: frame["gesture"] == "forward")
        message = show_until(
            operator, hand("forward"), lambda frame: frame["doubt"] == "stale_picture"
        )
        assert message["reason"].startswith("the picture of the robot that you see is 1.")
        wait_for(lambda: node.commands[-1].doubt == "stale_picture", "the reason at the robot")
        operator.send("picture", camera="scene", tick=node.state().tick)
        show_until(operator, hand("forward"), lambda frame: frame["doubt"] is None)


def test_held_keys_command_the_robot_and_frames_do_not_meanwhile(
    server: Running, node: StandIn, hand: Hand
) -> None:
    up = {"type": "jog_cartesian", "frame": "base", "linear": [0.0, 0.0, 0.1]}
    with server.operator() as operator:
        operator.send("jog", hold=1, action=up, tick=operator.tick)
        refused = operator.next("jog", hold=1)
        assert refused["reason"] == "nobody has control: take control first"
        take_and_arm(operator)
        operator.send("jog", hold=2, action=up, scale=0.5, tick=operator.tick)
        command = wait_for(
            lambda: next((c for c in node.commands if c.action is not None), None), "no command"
        )
        assert command.action.model_dump(exclude={"duration"})["linear"] == (0.0, 0.0, 0.1)
        assert (command.scale, command.frame) == (0.5, None)
        before = len(node.commands)
        operator.show(hand("open"))
        operator.send("jog", hold=2, action=None, tick=operator.tick)
        wait_for(lambda: len(node.commands) > before, "nothing held is no command")
        assert all(c.frame is None for c in node.commands[before:])
        operator.send("jog", hold=3, action=up, tick=max(1, operator.tick - 5000))
        assert "too old to move the robot" in operator.next("jog", hold=3)["reason"]


def test_the_speed_that_is_asked_for_goes_to_the_robot(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        operator.show(hand(None))
        wait_for(lambda: node.commands and node.commands[-1].scale == 1.0, "the ordinary speed")
        operator.send("speed", scale=0.2)
        operator.show(hand(None))
        wait_for(lambda: node.commands[-1].scale == 0.2, "the lower speed")
        for wrong in (0.0, 1.5, "fast"):
            operator.send("speed", scale=wrong)
            assert operator.next("error")["code"] == "message_values"


def test_the_robot_message_tells_what_the_supervisor_and_the_limits_do(server: Running) -> None:
    with server.operator() as operator:
        robot = operator.next("robot")
    assert robot["doubt"] is None
    assert robot["scale"] == 1.0
    assert robot["commanded"] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert robot["clearance"]["thing"] == "table"
    assert robot["clearance"]["distance"] == 0.05
    assert robot["transitions"] == [
        {"number": 1, "tick": 5, "before": "disarmed", "after": "armed", "stop": None,
         "reason": None},
    ]  # fmt: skip
    assert robot["dropped"] == {"epoch": 3}
    # The stand-in's clock is this machine's, as the server's is.
    assert robot["tick"] - robot["age_ms"] - robot["state_tick"] == pytest.approx(0, abs=1000)


def test_things_are_put_back_over_rest_unless_the_robot_is_armed(
    server: Running, node: StandIn
) -> None:
    answer = server.http.post("/api/robots/puma/scene/reset")
    assert answer.status_code == 200
    assert answer.json()["mode"] == "disarmed"
    assert [request.kind for request in node.requests] == ["reset_scene"]
    with server.operator() as operator:
        take_and_arm(operator)
        refused = server.http.post("/api/robots/puma/scene/reset")
    assert refused.status_code == 409
    assert refused.json()["error"]["code"] == "armed"
    assert server.http.post("/api/robots/moon/scene/reset").status_code == 404
