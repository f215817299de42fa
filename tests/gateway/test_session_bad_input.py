"""Whatever is sent to the operator WebSocket that it does not ask for."""

import json
import struct

import cv2
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from app.link.header import FrameHeader
from tests.gateway.operating import Hand
from tests.gateway.running import Operator, Running


@pytest.fixture
def server(lasting: Running) -> Running:
    """One for all: what is refused leaves nothing behind."""
    return lasting


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


def close_code(operator: Operator) -> int:
    """Read until the server closes, and return its code."""
    try:
        while True:
            operator.receive()
    except ConnectionClosed as error:
        assert error.rcvd is not None, "the connection broke without a close code"
        return error.rcvd.code


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
