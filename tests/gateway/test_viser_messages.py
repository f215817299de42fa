"""What a browser may send to viser: one message, read in full and written anew."""

import dataclasses

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viser import _messages

from app.gateway.closing import CLOSE_NOT_ALLOWED, CLOSE_TOO_BIG, Closing
from app.gateway.viser_messages import MAX_BYTES, ViewerCamera, read
from benchmarks.scene_cost import CAMERA
from tests.gateway.viser_types import every_message

encode = msgspec.msgpack.encode
REQUEST = encode({"type": "ShareUrlRequest"})
FROM_A_BROWSER = {
    **CAMERA,
    # JavaScript writes a whole number as an integer, whatever it stands for.
    "far": 1000,
    "look_at": [0, 0.5, 1],
    "up_direction": [4.930380657631324e-32, 0, 1],
    "image_width": 799.5,
}


def twice(name: str, first: object, second: object) -> bytes:
    """A map with a key that is there two times."""
    rest = {key: value for key, value in CAMERA.items() if key != name}
    pairs = [(name, first), *rest.items(), (name, second)]
    body = b"".join(encode(part) for pair in pairs for part in pair)
    return bytes([0x80 | len(pairs)]) + body


def test_where_a_camera_is_goes_on_and_viser_understands_it() -> None:
    message = _messages.Message.deserialize(read(encode(FROM_A_BROWSER)))
    assert isinstance(message, _messages.ViewerCameraMessage)
    assert message.look_at == (0.0, 0.5, 1.0)
    assert message.wxyz == CAMERA["wxyz"]
    assert (message.image_height, message.image_width) == (480, 799)


def test_visers_own_message_has_the_fields_that_are_read_here() -> None:
    theirs = {field.name for field in dataclasses.fields(_messages.ViewerCameraMessage)}
    assert theirs | {"type"} == {field.name for field in msgspec.structs.fields(ViewerCamera)}


@pytest.mark.parametrize("name", every_message())
def test_of_all_that_viser_knows_one_message_goes_on(name: str) -> None:
    data = every_message()[name]
    if name == "ViewerCameraMessage":
        assert msgspec.msgpack.decode(read(data)) == msgspec.msgpack.decode(data)
        return
    with pytest.raises(Closing) as closed:
        read(data)
    assert closed.value.code == CLOSE_NOT_ALLOWED


HOSTILE = {
    "nothing": b"",
    "text": "ViewerCameraMessage",
    "not msgpack": b"\xc1",
    "a number": b"\x01",
    "two messages in one": encode(CAMERA) + REQUEST,
    "a list of messages": encode([CAMERA, CAMERA]),
    "a message within a message": encode({**CAMERA, "wxyz": {"type": "ShareUrlRequest"}}),
    "no type": encode({key: value for key, value in CAMERA.items() if key != "type"}),
    "a type that is no word": encode({**CAMERA, "type": 1}),
    "a type that is a list": encode({**CAMERA, "type": ["ViewerCameraMessage"]}),
    "one key more": encode({**CAMERA, "excluded_self_client": 1}),
    "one key less": encode({key: value for key, value in CAMERA.items() if key != "fov"}),
    "a word for a number": encode({**CAMERA, "fov": "0.8"}),
    "true for a number": encode({**CAMERA, "fov": True}),
    "no number": encode({**CAMERA, "fov": None}),
    "not a number": encode({**CAMERA, "fov": float("nan")}),
    "without end": encode({**CAMERA, "position": (0.0, float("inf"), 0.0)}),
    "five of four": encode({**CAMERA, "wxyz": [0.0] * 5}),
    "an extension": encode({**CAMERA, "fov": msgspec.msgpack.Ext(1, b"x")}),
    "a time": b"\xd6\xff\x00\x00\x00\x00",
    "four billion keys": b"\xdf\xff\xff\xff\xff",
    "four billion parts": b"\xdd\xff\xff\xff\xff",
    "four billion bytes": b"\xc6\xff\xff\xff\xff",
    "deep": b"\x91" * (MAX_BYTES - 1) + b"\x90",
    "deep where a number should be": encode(CAMERA)[:-1] + b"\x91" * 700 + b"\x01",
    "cut short": encode(CAMERA)[:-3],
    "another type at last": twice("type", "ViewerCameraMessage", "ShareUrlRequest"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_made_to_hurt_is_refused(name: str) -> None:
    data = HOSTILE[name]
    if name == "another type at last":
        # Two parsers may differ on which of the two counts; what goes on has one.
        try:
            data = read(data)
        except Closing:
            return
        assert msgspec.msgpack.decode(data)["type"] == "ViewerCameraMessage"
        assert data.count(b"type") == 1
        return
    with pytest.raises(Closing) as closed:
        read(data)
    assert closed.value.code == CLOSE_NOT_ALLOWED
    assert len(closed.value.reason.encode()) <= 123


def test_the_first_of_two_types_does_not_smuggle_the_other() -> None:
    with pytest.raises(Closing):
        read(twice("type", "ShareUrlRequest", "ViewerCameraMessage"))


def test_what_is_long_is_not_read() -> None:
    for data in (b"x" * (MAX_BYTES + 1), encode({**CAMERA, "far": "x" * MAX_BYTES})):
        with pytest.raises(Closing) as closed:
            read(data)
        assert closed.value.code == CLOSE_TOO_BIG


def test_no_line_of_a_senders_own_gets_into_the_log() -> None:
    with pytest.raises(Closing) as closed:
        read(encode({**CAMERA, "type": "x\nlevel=INFO all is well\x1b[2J\U0001f600"}))
    assert closed.value.reason.isprintable()
    assert closed.value.reason.isascii()


@given(st.binary(max_size=300))
def test_bytes_of_any_kind_are_read_or_refused(data: bytes) -> None:
    with pytest.raises(Closing):
        read(data)


@given(st.integers(0, len(encode(CAMERA)) - 1), st.integers(0, 255))
def test_one_changed_byte_makes_no_other_message(place: int, byte: int) -> None:
    changed = bytearray(encode(CAMERA))
    changed[place] = byte
    try:
        message = _messages.Message.deserialize(read(bytes(changed)))
    except Closing:
        return
    assert isinstance(message, _messages.ViewerCameraMessage)
