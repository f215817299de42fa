"""The gateway's side of a robot, without a server around it."""

from pathlib import Path

import pytest

from app.errors import RobotUnavailable
from app.gateway.robot_port import RobotPort
from app.link.messages import State, StopRequest
from tests.gateway.running import StandIn, settings_for, wait_for


def test_a_stop_before_the_first_state_is_confirmed_only_once_it_was_heard(
    node: StandIn, tmp_path: Path
) -> None:
    node.deaf_to_stops = True
    port = RobotPort(settings_for(tmp_path, node.endpoint))
    try:
        request = StopRequest(source="test", reason="enough")
        port.start()
        with pytest.raises(RobotUnavailable, match="sent but not confirmed"):
            port.stop(request, 1.5)
        assert port.state is not None
        node.deaf_to_stops = False
        port.stop(request, 5)
        wait_for(lambda: node.stops, "the stop")
    finally:
        port.close()


def test_a_newer_state_that_is_not_what_is_waited_for_is_waited_past(
    node: StandIn, tmp_path: Path
) -> None:
    """One that was on its way when the robot agreed to something does not show it."""
    port = RobotPort(settings_for(tmp_path, node.endpoint))
    try:
        port.start()
        assert port.wait_newer(20)
        assert not port.wait_newer(0.5, lambda state: state.mode == "nothing of ours")
        ticks: set[int] = set()

        def seen(state: State) -> int:
            ticks.add(state.tick)
            return len(ticks)

        assert port.wait_newer(20, lambda state: seen(state) > 2)
    finally:
        port.close()
