"""Control, stops, keys and speed, asked for on the operator WebSocket."""

import threading
import time

import pytest

from app.gateway.frame_job import FrameDone, FrameJob, FrameWorker
from app.gateway.lease_keeper import RENEW_S, SILENT_S
from tests.gateway.operating import Hand, rest, show_until, take_and_arm
from tests.gateway.running import Running, StandIn, wait_for


def test_control_is_taken_kept_and_given_back(server: Running, node: StandIn) -> None:
    with server.operator() as operator:
        operator.send("take_control")
        operator.next("robot", controller=operator.hello["session"])
        wait_for(lambda: [r for r in node.requests if r.kind == "renew"], "a renewal")
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
    wait_for(lambda: node.holder is None, "the lease to be free")


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
        gone = operator.next("robot", online=False)
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


def test_the_stop_gesture_stops_without_control(server: Running, node: StandIn, hand: Hand) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        show_until(operator, hand("stop"), lambda frame: frame["gesture"] == "stop")
        stop = wait_for(lambda: node.stops and node.stops[0], "a stop")
        assert stop.category == "S1"
        assert stop.source == operator.hello["session"]
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


def test_held_keys_command_the_robot_and_frames_do_not_meanwhile(
    server: Running, node: StandIn, hand: Hand
) -> None:
    up = {"type": "jog_cartesian", "frame": "base", "linear": [0.0, 0.0, 0.1]}
    with server.operator() as operator:

        def press(hold: int, action: dict | None, **more: float) -> None:
            """One message, by a page that has seen the newest tick."""
            operator.next("robot")
            operator.send("jog", hold=hold, action=action, tick=operator.tick, **more)

        press(1, up)
        refused = operator.next("jog", hold=1)
        assert refused["reason"] == "nobody has control: take control first"
        take_and_arm(operator)
        command = wait_for(
            lambda: (
                press(2, up, scale=0.5)
                or next((c for c in node.commands if c.action is not None), None)
            ),
            "a command",
        )
        assert command.action.model_dump(exclude={"duration"})["linear"] == (0.0, 0.0, 0.1)
        assert (command.scale, command.frame) == (0.5, None)
        before = len(node.commands)
        operator.show(hand("open"))
        wait_for(lambda: press(2, None) or len(node.commands) > before, "a command for nothing")
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
