"""What the browsers are told about a robot."""

from typing import Any

from app.gateway.numbers import tick_ms
from app.gateway.robot_port import RobotPort
from app.link.actions import ACTION
from app.link.messages import Clearance


def robot_message(robot: RobotPort) -> dict[str, Any]:
    """The ``robot`` message: the newest state, and what is wrong when there is none.

    A robot that is not heard is ``faulted`` and not armed, whatever it said last; ``joints`` are
    then the last ones known, or empty before the first.
    """
    state = robot.state
    online = robot.online
    age = robot.age_s
    message: dict[str, Any] = {
        "type": "robot",
        "tick": tick_ms(),
        "robot": robot.id,
        "online": online,
        "age_ms": None if age is None else round(age * 1000),
        "mode": state.mode if online and state is not None else "faulted",
        "armed": online and state is not None and state.armed,
        "controller": state.controller if online and state is not None else None,
        "fault": robot.fault,
        "joints": [],
        "gripper": None,
        "seq": None,
    }
    if state is not None:
        message |= {
            "state_tick": state.tick,
            "joints": [round(joint, 6) for joint in state.joints],
            "velocities": [round(velocity, 6) for velocity in state.velocities],
            "gripper": round(state.gripper, 6),
            "tool": {
                "position": [round(value, 6) for value in state.tool_position],
                "orientation": [round(value, 6) for value in state.tool_orientation],
            },
            "base": None if state.base is None else [round(value, 6) for value in state.base],
            "seq": state.frame,
            "seq_tick": state.began,
            "stop": state.stop,
            "stops": state.stops,
            "latch": state.latch.model_dump(),
            "reason": state.reason,
            "action": None
            if state.action is None
            else ACTION.dump_python(state.action, mode="json", exclude_none=True),
            "doubt": state.doubt,
            "limits": list(state.limits),
            "scale": state.scale,
            "commanded": [round(joint, 6) for joint in state.commanded],
            "clearance": _clearance(state.clearance),
            "transitions": [step.model_dump() for step in state.transitions],
            "dropped": state.dropped,
            "loop": None if state.loop is None else state.loop.model_dump(),
        }
    return message


def _clearance(clearance: Clearance | None) -> dict[str, Any] | None:
    if clearance is None:
        return None
    return {
        "distance": round(clearance.distance, 4),
        "link": clearance.link,
        "thing": clearance.thing,
        "itself": clearance.itself,
    }


def robot_summary(robot: RobotPort) -> dict[str, Any]:
    """One entry of ``GET /api/robots``."""
    message = robot_message(robot)
    description = robot.description
    state = robot.state
    keep = ("online", "mode", "armed", "controller", "fault", "age_ms")
    return {
        "id": robot.id,
        "name": description.name if description is not None else robot.id,
        "model": description.model if description is not None else None,
        **{name: message[name] for name in keep},
        "restarts": robot.restarts,
        "latch": None if state is None else state.latch.model_dump(),
        "remembered": robot.stop_memory.kept.model_dump(),
    }


def robot_detail(robot: RobotPort) -> dict[str, Any]:
    """``GET /api/robots/{id}``: the summary, what the robot is, and its newest state in full."""
    state = robot.state
    description = robot.description
    return {
        **robot_summary(robot),
        "description": None if description is None else description.model_dump(mode="json"),
        "state": None if state is None else state.model_dump(mode="json"),
    }
