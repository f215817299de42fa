"""What the page says of the robot and of the hand, in one sentence each."""

from typing import Any, get_args

import pytest
from playwright.sync_api import Page

from app.link.messages import Doubt
from app.pipeline.types import Cause
from app.robot.controller import DOUBTS
from tests.e2e.running import run


@pytest.mark.parametrize(
    ("action", "reason", "expected"),
    [
        ({"type": "home"}, None, "“g” is done. Lower your hand, then show the next one."),
        ({"type": "jog_joint", "joint": 1, "velocity": 1.0}, None, "Sees “g”."),
        (
            {"type": "pose", "name": "moon"},
            "this robot has no pose 'moon'",
            "Sees “g”. This robot has no pose 'moon'.",
        ),
    ],
)
def test_a_held_gesture_while_the_arm_stands(
    modules: Page, action: dict[str, Any], reason: str | None, expected: str
) -> None:
    """Only what ends by itself is called done; what is refused says why."""
    state = {
        "connection": {"state": "open"},
        "hello": {"session": "me"},
        "robot": {
            "mode": "armed", "armed": True, "controller": "me", "reason": reason, "online": True,
        },
        "source": {"state": "running"},
        "frame": {"reason": None},
        "frameAt": 0,
        "gesture": {"gesture": "g", "phase": "hold"},
        "gestures": [{"name": "g", "action": action}],
    }  # fmt: skip
    assert run(modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", state) == expected


def test_an_observer_is_told_to_watch(modules: Page) -> None:
    state: dict[str, Any] = {
        "connection": {"state": "open"},
        "hello": {"session": "me", "role": "observer"},
        "robot": {"mode": "disarmed", "controller": None, "online": True},
        "source": {"state": "none"},
    }

    def told() -> str:
        return str(run(modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", state))

    assert told() == "Nobody drives. You watch, and can stop the robot."
    state["robot"]["controller"] = "operator-1"
    assert told() == "operator-1 drives. You watch; your gestures move nothing."
    state["robot"]["mode"] = "stopped"
    assert told() == "Stopped. An operator can reset it."


@pytest.mark.parametrize(
    ("mode", "status", "waiting_ms", "more"),
    [
        ("stopped", "kept", 0, ""),
        ("stopped", "pending", 900, ""),
        ("stopped", "pending", 1100, " Do not switch the robot off: it is not there."),
        ("stopped", "failed", 0, " Do not switch the robot off: it is not there."),
        ("disarmed", "failed", 0, " The robot cannot be armed: it is not there."),
    ],
)
def test_what_the_disk_does_not_know_is_said(
    modules: Page, mode: str, status: str, waiting_ms: int, more: str
) -> None:
    reason = None if status == "kept" else "it is not there"
    state: dict[str, Any] = {
        "connection": {"state": "open"},
        "hello": {"session": "me", "role": "observer"},
        "robot": {
            "mode": mode,
            "controller": None,
            "online": True,
            "latch": {"status": status, "reason": reason, "waiting_ms": waiting_ms},
        },
        "source": {"state": "none"},
    }
    told = str(run(modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", state))
    state["robot"]["latch"] = None
    without = str(run(modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", state))
    assert told == without + more


def holding(doubt: str | None, reason: str) -> dict[str, Any]:
    """A store of one who drives an arm that holds still."""
    return {
        "connection": {"state": "open"},
        "hello": {"session": "me"},
        "robot": {
            "mode": "holding", "armed": True, "controller": "me", "online": True,
            "doubt": doubt, "reason": reason,
        },
        "source": {"state": "running"},
    }  # fmt: skip


def test_every_doubt_is_told_in_words_of_its_own(modules: Page) -> None:
    told = {
        doubt: run(
            modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", holding(doubt, DOUBTS[doubt])
        )
        for doubt in get_args(Doubt)
    }
    assert len(set(told.values())) == len(told)
    for doubt, sentence in told.items():
        assert sentence.startswith("Holding still: your ") or doubt in (
            "two_hands",
            "stale_picture",
        ), sentence
        assert sentence.endswith(". Show no gesture for half a second, then show it again."), (
            sentence
        )
    silent = "no command in time: the picture or the link failed"
    assert run(
        modules, "ui/sentence.js", "return m.sentenceFor(a, 100)", holding(None, silent)
    ).startswith(f"Holding still: {silent}. ")


def seen(cause: str | None, match: str | None = None, held: str | None = None) -> dict[str, Any]:
    """A store in which ``two`` is nearest to the hand, and ``three`` nearest but one."""
    return {
        "source": {"state": "running"},
        "frame": {"cause": cause, "match": match and {"gesture": match}, "gesture": held},
        "frameAt": 0,
        "detail": {"distances": {"five": 0.7, "three": 0.31, "two": 0.3}, "threshold": 0.4},
        "detailAt": 0,
    }


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        (seen("no_hand") | {"detail": None}, "No hand in the box."),
        (seen("moving"), "Perhaps “two”, but the hand moves: hold still."),
        (seen("moving") | {"detail": None}, "The hand moves: hold it still."),
        (
            seen("low_margin"),
            "“two” is closest, and “three” almost as close: show it more clearly.",
        ),
        (
            seen("unknown_hand"),
            "“two” is closest, but the outline is unlike any that is taught.",
        ),
        (
            seen("unknown_hand")
            | {"detail": {"distances": {"two": 0.5, "three": 0.9}, "threshold": 0.4}},
            "“two” is closest, but too far off to count.",
        ),
        (seen(None, "two"), "“two” is closest, before “three”: hold still."),
        (seen(None, "two", "two"), "It is “two”; “three” is farther off."),
        # The distances are still those of the gesture before.
        (seen(None, "five", "five"), "It is “five”."),
        (seen(None) | {"source": {"state": "none"}}, "No picture: choose a camera above."),
        (seen(None) | {"frameAt": -9999}, "No picture was looked at for a while."),
    ],
)
def test_the_recognition_is_told_in_one_sentence(
    modules: Page, state: dict[str, Any], expected: str
) -> None:
    assert run(modules, "ui/thought.js", "return m.thoughtFor(a, 100)", state) == expected


def test_every_cause_has_a_sentence_of_its_own(modules: Page) -> None:
    causes = get_args(Cause)
    states = [seen(cause) | {"detail": None} for cause in causes]
    told = run(modules, "ui/thought.js", "return a.map((each) => m.thoughtFor(each, 100))", states)
    assert len(set(told)) == len(causes)
