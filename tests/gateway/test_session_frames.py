"""Frames sent to the operator WebSocket, and what comes of them at the robot."""

import time

import cv2
import numpy as np

from app.link.messages import COMMAND_TTL_MS
from tests.gateway.operating import Hand, rest, show_until, take_and_arm
from tests.gateway.running import Running, StandIn, wait_for


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
        assert operator.next("gesture", phase="end")["gesture"] == "up"


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
