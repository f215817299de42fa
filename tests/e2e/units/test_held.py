"""Driving by what is held: keys, buttons, a gamepad; and how fast."""

from typing import Any

import pytest
from playwright.sync_api import Page

from app.link.actions import ACTION
from tests.e2e.running import run


def test_the_speed_is_what_slider_and_fine_say_and_nonsense_is_the_ordinary(modules: Page) -> None:
    script = "return a.map((state) => m.speedOf(state))"
    states = [{"speed": s, "fine": f} for s, f in ((1, False), (0.5, True), (0.1, True))]
    assert run(modules, "ui/speed.js", script, states) == [1, 0.2, 0.1]
    known = run(
        modules,
        "ui/speed.js",
        "return a.map(m.knownSpeed)",
        [None, "", "x", "0.04", "7", "0.35", "NaN"],
    )
    assert known == [1, 1, 1, 1, 1, 0.35, 1]


def test_a_slider_is_no_field_that_swallows_the_stop_key(modules: Page) -> None:
    script = (
        "const host = document.createElement('div');"
        "host.append(...a.map((type) => Object.assign(document.createElement('input'), {type})));"
        "return [...host.children].map(m.isField)"
    )
    assert run(modules, "ui/dom.js", script, ["text", "number", "range"]) == [True, True, False]


ROBOT = {
    "joints": [
        {"name": "waist", "unit": "rad", "velocity": 2.0},
        {"name": "rail", "unit": "m", "velocity": 0.05},
    ],
    "poses": {"home": [0, 0], "ready": [1, 0]},
    "gripper_max": 0.08,
    "drives": False,
}


def test_all_that_can_be_held_is_an_action_and_has_words(modules: Page) -> None:
    gestures = [
        {
            "id": "g",
            "name": "wave",
            "active": True,
            "action": {"type": "sequence", "steps": [{"type": "home"}]},
        },
        {
            "id": "h",
            "name": "up",
            "active": True,
            "action": {"type": "jog_joint", "joint": 1, "velocity": 1},
        },
    ]
    script = (
        "return [m.movesOf(a[0], a[1]), m.movesOf({...a[0], drives: true, gripper_max: 0}, [])]"
    )
    arm, base = run(modules, "ui/moves.js", script, [ROBOT, gestures])
    for groups in (arm, base):
        moves = [move for group in groups.values() for move in group]
        for move in moves:
            ACTION.validate_python(move["action"])
            assert move["label"]
        ids = [move["id"] for move in moves]
        keys = [move["key"] for move in moves if move.get("key")]
        assert len(set(ids)) == len(ids) and len(set(keys)) == len(keys)
    assert [move["label"] for move in arm["program"]] == ["wave"]
    assert arm["joint"][3]["action"]["velocity"] == 0.05  # no faster than the joint can
    assert [move["id"] for move in arm["pose"]] == ["home", "pose-ready"]
    assert [move["id"] for move in base["move"]] == ["forward", "back", "turn-left", "turn-right"]
    assert base["tool"] == []


@pytest.mark.parametrize(
    ("axes", "down", "expected"),
    [
        ([0, -1, 0, 0], [], [False, None, 1]),
        ([0, -1, 0, 0], [4], [True, "forward", 1]),
        ([0.1, 0.2, -0.1, 0], [4], [True, None, 1]),
        ([0.3, 0, -1, 0], [5], [True, "turn-left", 1]),
        ([0, 0, 0, 0.625], [5], [True, "down", 0.5]),
        ([1, 0, 0, 0], [5, 0], [True, "close", 1]),
        ([], [4], [True, None, 1]),
    ],
)
def test_a_gamepad_moves_only_with_a_shoulder_button(
    modules: Page, axes: list[float], down: list[int], expected: list[Any]
) -> None:
    buttons = [{"pressed": number in down} for number in range(17)]
    script = "const p = m.readPad(a); return [p.enabled, p.move, p.scale, p.stop]"
    pad = run(modules, "core/gamepad.js", script, {"axes": axes, "buttons": buttons})
    assert pad == [*expected, False]
    buttons[1]["pressed"] = True
    assert run(modules, "core/gamepad.js", script, {"axes": axes, "buttons": buttons})[3] is True


def test_one_thing_is_held_at_a_time_and_told_over_and_over(modules: Page) -> None:
    script = """
        const sent = [];
        const held = new m.Held({tick: 7, send: (type, message) => sent.push([type, message])});
        const up = {id: "up", action: {type: "home"}};
        held.press("k1", up);
        const before = sent.length;
        held.start();
        held.press("k1", up);
        held.press("k1", up, 0.5);
        held.press("k2", {id: "down", action: {type: "home"}});
        held.release("k1");
        const still = held.id;
        held.release("k2");
        const told = sent.length;
        await new Promise((done) => setTimeout(done, 400));
        held.stop();
        return [before, still, sent.slice(0, told), sent.length > told + 2, held.id];
    """
    before, still, sent, more, after = run(modules, "core/held.js", script)
    assert (before, still, more, after) == (0, "down", True, None)
    assert [kind for kind, _ in sent] == ["jog"] * len(sent)
    assert [(message["hold"], message["action"] is not None) for _, message in sent] == [
        (0, False), (1, True), (2, True), (2, False),
    ]  # fmt: skip
    assert {message["tick"] for _, message in sent} == {7}
