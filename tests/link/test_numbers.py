"""Numbers in what people send: a number, and nothing that Python would take for one."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from app.errors import MessageRefused
from app.gateway.messages import parse_client_message
from app.link.actions import ACTION

ACTIONS: tuple[dict[str, Any], ...] = (
    {"type": "jog_joint", "joint": 1, "velocity": 0.5},
    {"type": "jog_cartesian", "linear": [0.1, 0, 0], "angular": [0, 0.1, 0]},
    {"type": "turn_joint", "joint": 2, "angle": 1},
    {"type": "move_linear", "offset": [0.1, 0, 0], "rotation": [0, 0, 1], "speed": 0.1},
    {"type": "gripper", "width": 0.05, "force": 10},
    {
        "type": "sequence",
        "steps": [
            {"type": "wait", "duration": 1},
            {"type": "jog_joint", "joint": 1, "velocity": 0.5, "duration": 1},
            {"type": "repeat", "times": 2, "steps": [{"type": "wait", "duration": 1}]},
        ],
    },
)
MESSAGES: tuple[dict[str, Any], ...] = (
    {"type": "speed", "scale": 0.5},
    {"type": "picture", "camera": "wrist", "tick": 1},
    {"type": "ping", "t": 1},
    {"type": "jog", "hold": 1, "action": ACTIONS[0], "scale": 1, "tick": 1},
)
FLAGS: tuple[dict[str, Any], ...] = (
    {"type": "take_control", "takeover": True},
    {"type": "view", "detail": True, "glass": False},
)


def spoilt(value: Any, wrong: Any, flags: bool = False) -> list[Any]:
    """Copies of ``value``, in each of which one number (or flag) is something else."""
    if isinstance(value, dict):
        pairs = [(key, each) for key, each in value.items()]
        return [{**value, key: bad} for key, each in pairs for bad in spoilt(each, wrong, flags)]
    if isinstance(value, list):
        return [
            [*value[:index], bad, *value[index + 1 :]]
            for index, each in enumerate(value)
            for bad in spoilt(each, wrong, flags)
        ]
    is_one = isinstance(value, bool) if flags else isinstance(value, int | float)
    return [wrong(value)] if is_one else []


@pytest.mark.parametrize(
    "wrong", [bool, str, lambda value: f" {value} "], ids=["bool", "text", "spaced"]
)
@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action["type"])
def test_an_action_takes_numbers_alone(action: dict[str, Any], wrong: Any) -> None:
    ACTION.validate_json(json.dumps(action))
    ACTION.validate_json(json.dumps(action).replace(": 1,", ": 1.0,"))
    bad = spoilt(action, wrong)
    assert bad
    for each in bad:
        with pytest.raises(ValidationError, match="must be a number"):
            ACTION.validate_json(json.dumps(each))
        with pytest.raises(ValidationError, match="must be a number"):
            ACTION.validate_python(each)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: message["type"])
def test_a_message_takes_numbers_alone(message: dict[str, Any]) -> None:
    parse_client_message(json.dumps(message))
    for wrong in (bool, str):
        for each in spoilt(message, wrong):
            with pytest.raises(MessageRefused, match="must be a number"):
                parse_client_message(json.dumps(each))


@pytest.mark.parametrize("message", FLAGS, ids=lambda message: message["type"])
def test_a_flag_is_true_or_false(message: dict[str, Any]) -> None:
    parse_client_message(json.dumps(message))
    for wrong in (int, lambda _: "true", lambda _: "yes"):
        for each in spoilt(message, wrong, flags=True):
            with pytest.raises(MessageRefused, match="boolean"):
                parse_client_message(json.dumps(each))
