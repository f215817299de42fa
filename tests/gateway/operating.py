"""What somebody does who drives by the operator WebSocket."""

import time
from collections.abc import Callable

from tests.gateway.running import Operator

Hand = Callable[..., bytes]


def take_and_arm(operator: Operator) -> None:
    operator.send("take_control")
    operator.next("robot", controller=operator.hello["session"])
    operator.send("arm")
    operator.next("robot", mode="armed")


def rest(operator: Operator, jpeg: bytes, frames: int = 4) -> None:
    for _ in range(frames):
        operator.show(jpeg)
        time.sleep(0.03)


def show_until(
    operator: Operator, jpeg: bytes, condition: Callable[[dict], bool], timeout_s: float = 10.0
) -> dict:
    """Show a picture as a webcam would until a frame message satisfies the condition."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        message = operator.show(jpeg)
        if condition(message):
            return message
        time.sleep(0.03)
    raise AssertionError(f"last frame message: {message}")
