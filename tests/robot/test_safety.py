"""The state machine is what its own picture says, cell by cell, and tells every step."""

import re
from collections.abc import Callable

import pytest

from app.link.messages import StopRequest
from app.robot import safety as module
from app.robot.latch import StopLatch
from app.robot.safety import KEPT_TRANSITIONS, NO_GESTURE_S, Phase, Safety

EVENTS = ("arm", "disarm", "lease gone", "stop S2", "stop S1", "N", "reset")
"""The columns of the picture."""


def picture() -> dict[tuple[str, str], str]:
    """The picture in the docstring: (phase, event) to what stands in the cell."""
    assert module.__doc__ is not None
    cells = {}
    for line in module.__doc__.splitlines():
        row = re.match(r"\s+(DISARMED|HOLDING|ARMED|STOPPED)\s+\|\s*(.*)", line)
        if row:
            words = row[2].split()
            assert len(words) == len(EVENTS), line
            cells |= {(row[1], event): word for event, word in zip(EVENTS, words, strict=True)}
    return cells


CELLS = picture()


def stop(category: str) -> StopRequest:
    return StopRequest(category=category, source="test", reason="asked to")


def met_n(safety: Safety) -> None:
    safety.saw(10.0, gesture=False)
    safety.saw(10.0 + NO_GESTURE_S, gesture=False)


def at(phase: str, stopped: str = "S1") -> Safety:
    """A safety in a phase, as it comes about."""
    safety = Safety(StopLatch(None))
    if phase == "STOPPED":
        safety.stop(stop(stopped))
    elif phase != "DISARMED":
        safety.arm()
        if phase == "HOLDING":
            safety.stop(stop("S2"))
    assert safety.phase is Phase[phase]
    return safety


DO: dict[str, Callable[[Safety], object]] = {
    "arm": lambda safety: safety.arm(),
    "disarm": lambda safety: safety.disarm("by hand"),
    "lease gone": lambda safety: safety.lease_gone("anna is gone"),
    "stop S2": lambda safety: safety.stop(stop("S2")),
    "stop S1": lambda safety: safety.stop(stop("S1")),
    "N": met_n,
    "reset": lambda safety: safety.reset(at_rest=True),
}


def test_the_picture_has_every_phase_and_event() -> None:
    assert set(CELLS) == {(phase.name, event) for phase in Phase for event in EVENTS}


@pytest.mark.parametrize(("phase", "event"), CELLS)
def test_every_cell_of_the_picture(phase: str, event: str) -> None:
    safety, cell = at(phase), CELLS[phase, event]
    answer = DO[event](safety)
    if cell in ("*", "worst"):
        cell = {"*": "ARMED", "worst": "STOPPED"}[cell]
    expected = {"-": phase, "refused": phase, "DISARM": "DISARMED"}.get(cell, cell)
    assert safety.phase is Phase[expected]
    if event in ("arm", "reset"):
        assert answer.granted == (cell != "refused")
    assert safety.may_move == (expected == "ARMED")
    assert safety.armed == (expected in ("ARMED", "HOLDING"))


@pytest.mark.parametrize("event", ["lease gone", "stop S2", "stop S1"])
def test_the_star_of_the_picture(event: str) -> None:
    """Arming after a stop leads to HOLDING until N, whatever the stop was."""
    safety = at("ARMED")
    DO[event](safety)
    safety.reset(at_rest=True)
    safety.disarm("by hand")
    safety.arm()
    assert safety.phase is Phase.HOLDING
    met_n(safety)
    assert safety.phase is Phase.ARMED
    safety.disarm("by hand")
    safety.arm()
    assert safety.phase is Phase.ARMED


@pytest.mark.parametrize("before", ["S1", "S0"])
@pytest.mark.parametrize("after", ["S2", "S1", "S0"])
def test_the_worst_stays_in_force(before: str, after: str) -> None:
    safety = at("STOPPED", before)
    safety.stop(stop(after))
    assert safety.phase is Phase.STOPPED
    assert safety.category == ("S0" if "S0" in (before, after) else "S1")


@pytest.mark.parametrize("phase", [phase.name for phase in Phase])
def test_a_stop_at_once_latches_from_everywhere(phase: str) -> None:
    safety = at(phase)
    safety.stop(stop("S0"))
    assert (safety.phase, safety.category) == (Phase.STOPPED, "S0")


def test_a_reset_of_a_moving_arm_is_refused() -> None:
    safety = at("STOPPED")
    assert safety.reset(at_rest=False).code == "moving"
    assert safety.phase is Phase.STOPPED


def test_a_gesture_or_silence_between_begins_n_anew() -> None:
    safety = at("HOLDING")
    for interruption in (lambda: safety.saw(10.3, gesture=True), safety.silence):
        safety.saw(10.0, gesture=False)
        interruption()
        safety.saw(10.6, gesture=False)
        assert safety.phase is Phase.HOLDING
        safety.silence()
    met_n(safety)
    assert safety.phase is Phase.ARMED


def test_every_step_is_told_once_and_in_order(caplog: pytest.LogCaptureFixture) -> None:
    safety = Safety(StopLatch(None), tick=5)
    assert not safety.transitions
    with caplog.at_level("INFO", logger=module.__name__):
        safety.tick = 1000
        safety.arm()
        safety.arm()  # armed already: no step
        safety.tick = 2000
        safety.hold("no hand is in the picture")
        safety.hold("no hand is in the picture")
        met_n(safety)
        safety.stop(stop("S1"))
    told = [(t.number, t.tick, t.before, t.after, t.stop, t.reason) for t in safety.transitions]
    assert told == [
        (1, 1000, "disarmed", "armed", None, None),
        (2, 2000, "armed", "holding", "S2", "no hand is in the picture"),
        (3, 2000, "holding", "armed", None, None),
        (4, 2000, "armed", "stopped", "S1", "asked to (test)"),
    ]
    logged = [record.getMessage() for record in caplog.records]
    assert logged == [
        "step 1: disarmed  -> armed : ready",
        "step 2: armed  -> holding S2: no hand is in the picture",
        "step 3: holding S2 -> armed : ready",
        "step 4: armed  -> stopped S1: asked to (test)",
    ]


def test_only_the_newest_steps_are_kept() -> None:
    safety = at("ARMED")
    for _ in range(10):
        safety.hold("x")
        met_n(safety)
    numbers = [step.number for step in safety.transitions]
    assert numbers == list(range(22 - KEPT_TRANSITIONS, 22))


def test_a_stop_from_before_the_start_is_a_step(tmp_path) -> None:
    latch = StopLatch(tmp_path / "latch")
    Safety(latch).stop(stop("S1"))
    latch.close()
    (step,) = Safety(StopLatch(tmp_path / "latch"), tick=7).transitions
    assert (step.tick, step.before, step.after, step.stop) == (7, "disarmed", "stopped", "S1")
