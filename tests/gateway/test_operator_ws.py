"""The operator WebSocket, spoken to as any client would."""

import time
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from tests.gateway.operating import Hand
from tests.gateway.running import Running, StandIn, running, settings_for, wait_for


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
        took = []
        for _ in range(5):
            started = time.monotonic()
            for _ in range(20):
                operator.next("robot")
            took.append(time.monotonic() - started)
            if took[-1] < 2.0:
                break
        assert min(took) < 2.0
    assert first["joints"] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert first["mode"] == "disarmed"
    assert first["armed"] is False
    assert first["controller"] is None
    assert first["fault"] is None
    assert first["online"] is True


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
        for _ in range(10):
            quick.next("robot")


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
