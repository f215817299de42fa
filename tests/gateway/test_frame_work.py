"""Frames have threads of their own: nothing that others send, and nothing that is drawn, waits."""

import threading
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from app.gateway import enrolment
from app.pipeline import FrameResult
from tests.gateway import held
from tests.gateway.operating import Hand, rest, show_until
from tests.gateway.running import Running, StandIn, running, settings_for, wait_for

UPLOADS = 8


@pytest.fixture
def hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "hold"
    path.touch()
    monkeypatch.setenv("HELD_WHILE", str(path))
    monkeypatch.setattr(enrolment, "look_at", held.look_at)
    return path


@pytest.fixture
def uploads(server: Running, hold: Path, hand: Hand) -> Iterator[list[httpx.Response]]:
    """Eight uploads that are worked on until ``hold`` is gone; their answers."""
    answers: list[httpx.Response] = []
    image = hand("forward")

    def upload() -> None:
        files = [("images", ("x.jpg", image, "image/jpeg"))]
        answers.append(server.http.post("/api/gestures/check", files=files))

    threads = [threading.Thread(target=upload) for _ in range(UPLOADS)]
    for thread in threads:
        thread.start()
    try:
        yield answers
    finally:
        hold.unlink(missing_ok=True)
        for thread in threads:
            thread.join(60)


def test_frames_and_a_stop_that_is_shown_go_on_while_uploads_are_worked_on(
    server: Running,
    node: StandIn,
    hand: Hand,
    hold: Path,
    uploads: list[httpx.Response],
) -> None:
    with server.operator() as operator, server.operator() as other:
        rest(operator, hand(None))
        rest(other, hand(None))
        show_until(operator, hand("left"), lambda frame: frame["gesture"] is not None, 60)
        show_until(other, hand("stop"), lambda frame: frame["gesture"] == "stop", 60)
        wait_for(lambda: node.stops, "the stop")
        operator.next("robot", mode="stopped")
        # The uploads are still worked on, and those that are not bound to end well.
        assert uploads == []
    hold.unlink()
    wait_for(lambda: len(uploads) == UPLOADS, "the answers", 60)
    assert [(answer.status_code, answer.json()["accepted"]) for answer in uploads] == [
        (200, 1)
    ] * UPLOADS


def test_one_upload_more_than_may_be_is_told_to_come_again(
    node: StandIn, folder: Path, hold: Path, hand: Hand
) -> None:
    with running(settings_for(folder, node.endpoint, max_uploads=1)) as server:
        files = [("images", ("x.jpg", hand("forward"), "image/jpeg"))]
        first: list[httpx.Response] = []
        thread = threading.Thread(
            target=lambda: first.append(server.http.post("/api/gestures/check", files=files))
        )
        thread.start()
        try:
            wait_for(lambda: server.hub.uploads._taken == 1)
            for path in ("/api/gestures/check", "/api/gestures"):
                answer = server.http.post(path, files=files)
                assert (answer.status_code, answer.json()["error"]["code"]) == (429, "busy")
                assert int(answer.headers["retry-after"]) >= 1
        finally:
            hold.unlink()
            thread.join(60)
        assert first[0].status_code == 200
        assert server.http.post("/api/gestures/check", files=files).status_code == 200


def test_who_hangs_up_is_worked_for_no_more(server: Running, hold: Path, hand: Hand) -> None:
    files = [("images", (f"{n}.jpg", hand("forward"), "image/jpeg")) for n in range(30)]
    with (
        httpx.Client(base_url=server.url, headers=server.http.headers, trust_env=False) as client,
        pytest.raises(httpx.ReadTimeout),
    ):
        client.post("/api/gestures/check", files=files, timeout=httpx.Timeout(30, read=1))
    # Its place is free although its first image is still worked on.
    wait_for(lambda: server.hub.uploads._taken == 0, "the place to be free")
    assert hold.exists()
    wait_for(lambda: server.http.get("/api/gestures/confusions").status_code == 200, timeout_s=60)


def test_a_stop_that_is_shown_is_sent_before_anything_else_is_made_of_the_frame(
    server: Running, node: StandIn, hand: Hand, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()
    real = FrameResult.as_message

    def slow(result: FrameResult, tick: int) -> object:
        if result.gesture == "stop":
            go_on.wait(60)
        return real(result, tick)

    monkeypatch.setattr(FrameResult, "as_message", slow)
    with server.operator() as operator, server.operator() as other:
        rest(operator, hand(None))
        try:

            def shown() -> bool:
                operator.frame(hand("stop"))
                return bool(node.stops)

            wait_for(shown, "the stop", 60)
            # Another's frames have another thread.
            other.show(hand(None))
        finally:
            go_on.set()
        operator.next("robot", mode="stopped")
