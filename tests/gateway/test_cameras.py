"""The relay of camera pictures, with a camera that counts what it publishes."""

import asyncio
import json
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection

from app.gateway import relay as module
from app.gateway.picture_pace import LEVELS
from app.gateway.relay import Relay
from app.link.header import HEADER_SIZE, FrameHeader
from tests.gateway.running import Running, StandIn, StandInCamera, wait_for


def test_pictures_are_made_only_while_somebody_watches(server: Running, node: StandIn) -> None:
    with StandInCamera(node, "wrist") as camera:
        time.sleep(0.2)
        assert camera.published == 0
        with server.socket("/ws/camera/wrist") as viewer:
            message = viewer.recv(timeout=10)
            assert message[HEADER_SIZE : HEADER_SIZE + 2] == b"\xff\xd8"
        wait_for(lambda: not camera.watched, "the watch to end")
        count = camera.published
        time.sleep(0.2)
        assert camera.published == count


def test_all_viewers_share_one_watch_and_a_slow_one_slows_nobody(
    server: Running, node: StandIn
) -> None:
    with StandInCamera(node, "scene", size=200_000) as camera:
        # Reads nothing at all, with as little room on the way as can be.
        with (
            server.socket("/ws/camera/scene", max_queue=1) as slow,
            server.socket("/ws/camera/scene") as quick,
        ):
            first = FrameHeader.unpack(quick.recv(timeout=10)).sequence
            started = time.monotonic()
            seen = [first]
            while seen[-1] < first + 60:
                seen.append(FrameHeader.unpack(quick.recv(timeout=10)).sequence)
            assert time.monotonic() - started < 20
            assert seen == sorted(set(seen))
            # What the slow one gets now is new, not a backlog.
            for _ in range(40):
                newest = FrameHeader.unpack(slow.recv(timeout=10)).sequence
            assert newest > first + 45
        assert camera.published > 0


def test_a_single_picture_is_fresh(server: Running, node: StandIn) -> None:
    with StandInCamera(node, "wrist"):
        for _ in range(2):
            answer = server.http.get("/api/cameras/wrist.jpg")
            assert answer.status_code == 200
            assert answer.content.startswith(b"\xff\xd8")
            assert answer.headers["cache-control"] == "no-store"


def test_no_picture_in_time_is_told(server: Running) -> None:
    started = time.monotonic()
    answer = server.http.get("/api/cameras/wrist.jpg")
    assert 1.5 < time.monotonic() - started < 15
    assert answer.status_code == 503
    assert answer.json()["error"]["code"] == "no_picture"


def test_mjpeg_goes_on_until_the_viewer_or_the_server_ends(server: Running, node: StandIn) -> None:
    with StandInCamera(node, "wrist"):
        parts = 0
        with server.http.stream("GET", "/api/cameras/wrist.mjpeg") as answer:
            assert answer.headers["content-type"].startswith("multipart/x-mixed-replace")
            buffer = b""
            for chunk in answer.iter_raw():
                buffer += chunk
                parts = buffer.count(b"Content-Type: image/jpeg\r\nContent-Length: ")
                if parts >= 3:
                    break
        assert parts >= 3
        wait_for(lambda: server.hub.relay.viewers == 0, "the viewer to be gone")

        ended = threading.Event()

        def watch() -> None:
            with server.http.stream("GET", "/api/cameras/wrist.mjpeg") as stream:
                for _ in stream.iter_raw():
                    pass
            ended.set()

        thread = threading.Thread(target=watch)
        thread.start()
        wait_for(lambda: server.hub.relay.viewers == 1, "the viewer")
        server.hub.closing.set()
        assert ended.wait(10)
        thread.join()


@pytest.mark.parametrize("name", ["nose", "..", "wrist%2F"])
def test_an_unknown_camera_is_refused(server: Running, name: str) -> None:
    for suffix in ("jpg", "mjpeg"):
        answer = server.http.get(f"/api/cameras/{name}.{suffix}")
        assert answer.status_code == 404
    with pytest.raises(InvalidStatus) as refused:
        server.socket(f"/ws/camera/{name}")
    assert refused.value.response.status_code in (403, 404)


def test_what_a_viewer_sends_is_ignored(server: Running, node: StandIn) -> None:
    with StandInCamera(node, "wrist"), server.socket("/ws/camera/wrist") as viewer:
        viewer.send("hello")
        viewer.send(b"\x00")
        viewer.recv(timeout=10)
        viewer.recv(timeout=10)


def shown(viewer: ClientConnection, message: bytes) -> None:
    sequence = FrameHeader.unpack(message).sequence
    viewer.send(json.dumps({"type": "shown", "seq": sequence}))


def test_who_acknowledges_late_gets_smaller_pictures_and_who_does_not_gets_them_as_they_are(
    server: Running, node: StandIn, hand: Callable[..., bytes]
) -> None:
    jpeg = hand("forward")
    with (
        StandInCamera(node, "wrist", jpeg=jpeg),
        server.socket("/ws/camera/wrist?acks=1") as late,
        server.socket("/ws/camera/wrist") as plain,
    ):
        for _ in range(5):
            message = late.recv(timeout=10)
            assert message[HEADER_SIZE:] == jpeg
            shown(late, message)
        wait_s = 0.2
        deadline = time.monotonic() + 60
        while len(message) > len(jpeg) / 2:
            assert time.monotonic() < deadline
            message = late.recv(timeout=10)
            time.sleep(wait_s)
            shown(late, message)
        before = FrameHeader.unpack(plain.recv(timeout=10)).sequence
        for _ in range(30):
            whole = plain.recv(timeout=10)
            assert whole[HEADER_SIZE:] == jpeg
            assert FrameHeader.unpack(whole).sequence > before


def test_who_wants_fewer_pictures_gets_fewer(server: Running, node: StandIn) -> None:
    with (
        StandInCamera(node, "wrist") as camera,
        server.socket("/ws/camera/wrist?acks=1") as viewer,
    ):
        message = viewer.recv(timeout=10)
        got, first = 0, camera.published
        while camera.published < first + 60:
            sequence = FrameHeader.unpack(message).sequence
            viewer.send(json.dumps({"type": "shown", "seq": sequence, "most": 3}))
            message = viewer.recv(timeout=10)
            got += 1
        # 60 pictures take two seconds, or longer.
        assert got <= (camera.published - first) / 10 + 6


def test_who_acknowledges_nothing_gets_a_few_pictures_and_slows_nobody(
    server: Running, node: StandIn
) -> None:
    with (
        StandInCamera(node, "wrist") as camera,
        server.socket("/ws/camera/wrist?acks=1") as silent,
        server.socket("/ws/camera/wrist?acks=1") as quick,
    ):
        got = []
        for _ in range(LEVELS[0].under_way):
            got.append(FrameHeader.unpack(silent.recv(timeout=10)).sequence)
        # None of this is an acknowledgement of what was sent.
        for text in ("hello", "[" * 5000, '{"type":"shown","seq":"1"}', '{"type":"shown","seq":0}'):
            silent.send(text)
        silent.send(b"\x00")
        first = camera.published
        while camera.published < first + 40:
            shown(quick, quick.recv(timeout=10))
        with pytest.raises(TimeoutError):
            silent.recv(timeout=0.2)
        silent.send(json.dumps({"type": "shown", "seq": got[-1]}))
        # It goes on with what is new.
        assert FrameHeader.unpack(silent.recv(timeout=10)).sequence > first


class Robot:
    """Watches of which each gives one picture, and closes only when it may."""

    description = None
    fault = None

    def __init__(self) -> None:
        self.watches = 0
        self.failures = 0
        self.closing = threading.Event()
        self.may_close = threading.Event()

    def watch_camera(self, name: str, callback: Any) -> "Robot":
        if self.failures:
            self.failures -= 1
            raise RuntimeError("the session is closed")
        self.watches += 1
        callback(FrameHeader(self.watches, 0.0, 0), b"jpeg")
        return self

    def close(self) -> None:
        self.closing.set()
        self.may_close.wait(10)


async def test_who_comes_while_the_watch_ends_gets_pictures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "LINGER_S", 0.0)
    monkeypatch.setattr(module, "RETRY_S", 0.01)
    robot = Robot()
    relay = Relay(robot)  # type: ignore[arg-type]
    assert await relay.picture("wrist", 5) == b"jpeg"
    await asyncio.to_thread(robot.closing.wait, 5)
    async with relay.view("wrist") as viewer:
        robot.may_close.set()
        async with asyncio.timeout(5):
            assert FrameHeader.unpack(await viewer.next()).sequence == 2
    await relay.close()


async def test_a_watch_that_fails_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "RETRY_S", 0.01)
    robot = Robot()
    robot.failures = 2
    robot.may_close.set()
    relay = Relay(robot)  # type: ignore[arg-type]
    assert await relay.picture("wrist", 5) == b"jpeg"
    await relay.close()


async def test_a_crowd_of_viewers_leaves_room_for_others_between() -> None:
    robot = Robot()
    robot.may_close.set()
    relay = Relay(robot)  # type: ignore[arg-type]
    log: list[str] = []

    async def look() -> None:
        async with relay.view("wrist") as viewer:
            await viewer.next()
            log.append("picture")

    async def turn() -> None:
        while log.count("picture") < 50:
            log.append("turn")
            await asyncio.sleep(0)

    async with asyncio.timeout(20), asyncio.TaskGroup() as group:
        for _ in range(50):
            group.create_task(look())
        group.create_task(turn())
    served = [len(run) for run in "".join(entry[0] for entry in log).split("t")]
    assert sum(served) == 50
    assert max(served) <= module.AT_ONCE
    await relay.close()
