"""The page's modules by themselves: no server behind them but one for static files."""

import gzip
import json
import re
import struct
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page

from app.gateway.messages import CLIENT_MESSAGES, SERVER_MESSAGES
from app.link.actions import ACTION
from app.link.header import HEADER_SIZE, FrameHeader
from tests.e2e.running import STATIC, run

SCRIPTS = sorted(STATIC.rglob("*.js"))
HTML = (STATIC / "index.html").read_text()


def test_message_names_agree_with_the_server(modules: Page) -> None:
    names = run(modules, "core/protocol.js", "return [m.CLIENT_MESSAGES, m.SERVER_MESSAGES]")
    assert tuple(names[0]) == CLIENT_MESSAGES
    assert tuple(names[1]) == SERVER_MESSAGES


def test_frame_header_is_what_the_server_reads(modules: Page) -> None:
    script = "return [...new Uint8Array(m.packFrame(7, 1234.5, 2 ** 40, new ArrayBuffer(3)))]"
    message = bytes(run(modules, "core/protocol.js", script))
    assert FrameHeader.unpack(message) == FrameHeader(7, 1234.5, 2**40)
    assert len(message) == HEADER_SIZE + 3


def test_frame_header_never_carries_what_the_server_refuses(modules: Page) -> None:
    script = "return [...new Uint8Array(m.packFrame(2 ** 32 + 1, -3, NaN, new ArrayBuffer(0)))]"
    message = bytes(run(modules, "core/protocol.js", script))
    assert FrameHeader.unpack(message) == FrameHeader(1, 0.0, 0)


def test_pictures_are_unpacked_and_nonsense_is_not(modules: Page) -> None:
    good = FrameHeader(5, 10.0, 99).pack() + b"jpeg"
    script = (
        "const p = m.unpackPicture(Uint8Array.from(a).buffer);"
        "return p && [p.seq, p.capturedMs, p.tick, [...p.jpeg]]"
    )
    assert run(modules, "core/protocol.js", script, list(good)) == [5, 10, 99, list(b"jpeg")]
    wrong_version = struct.pack("<2sBBIdQ", b"FH", 2, 0, 5, 10.0, 99) + b"jpeg"
    for bad in (b"", good[:24], b"XX" + good[2:], wrong_version):
        assert run(modules, "core/protocol.js", script, list(bad)) is None


@pytest.mark.parametrize(
    ("action", "words"),
    [
        ({"type": "jog_cartesian", "linear": [0.1, 0, 0]}, "forward 10 cm/s"),
        ({"type": "jog_cartesian", "linear": [0, -0.1, 0.05]}, "right 10 cm/s, up 5 cm/s"),
        ({"type": "jog_cartesian", "angular": [0, 0, -0.5]}, "turn about z \N{MINUS SIGN}28.6°/s"),
        (
            {"type": "jog_cartesian", "frame": "tool", "linear": [0, 0, -0.02]},
            "against tool z 2 cm/s",
        ),
        ({"type": "jog_joint", "joint": 2, "velocity": -0.5}, "turn J2 \N{MINUS SIGN}28.6°/s"),
        ({"type": "turn_joint", "joint": 1, "angle": 0.5235987755982988}, "turn J1 by 30°"),
        ({"type": "pose", "name": "ready"}, "go to “ready”"),
        ({"type": "gripper", "width": 0.0}, "close gripper"),
        ({"type": "gripper", "width": 0.08}, "open gripper"),
        ({"type": "gripper", "width": 0.04}, "gripper to 40 mm"),
        ({"type": "gripper", "width": 0.0, "force": 12.0}, "close gripper with 12 N"),
        (
            {"type": "move_linear", "offset": [0.05, 0, -0.1], "rotation": [0, 0, 0.5235987756]},
            "forward by 5 cm, down by 10 cm, turn about z by 30°",
        ),
        (
            {"type": "move_linear", "frame": "tool", "offset": [0, 0, 0.02]},
            "along tool z by 2 cm",
        ),
        ({"type": "move_linear"}, "stand still"),
        (
            {
                "type": "sequence",
                "steps": [
                    {
                        "type": "repeat",
                        "times": 3,
                        "steps": [{"type": "wait", "duration": 2}, {"type": "home"}],
                    },
                    {"type": "stop"},
                ],
            },
            "3 times: wait 2 s, then 1 step, then 1 step",
        ),
        ({"type": "home"}, "go home"),
        ({"type": "stop"}, "stop the robot"),
        (
            {
                "type": "sequence",
                "steps": [
                    {"type": "jog_cartesian", "linear": [0, 0, 0.1], "duration": 2},
                    {"type": "home"},
                ],
            },
            "up 10 cm/s for 2 s, then 1 step",
        ),
    ],
)
def test_actions_in_plain_words(modules: Page, action: dict[str, Any], words: str) -> None:
    sent = ACTION.dump_python(ACTION.validate_json(json.dumps(action)), mode="json")
    assert run(modules, "ui/words.js", "return m.describeAction(a)", sent) == words


@pytest.mark.parametrize(
    "action",
    [
        {"type": "jog_cartesian", "linear": [0.1, 0, 0]},
        {"type": "jog_cartesian", "frame": "tool", "linear": [0, 0.1, 0.2], "angular": [0, 0, 1]},
        {"type": "jog_joint", "joint": 6, "velocity": 0.5},
        {"type": "turn_joint", "joint": 3, "angle": -0.7},
        {"type": "pose", "name": "ready"},
        {"type": "gripper", "width": 0.03},
        {"type": "gripper", "width": 0.0, "force": 12.5},
        {"type": "move_linear", "offset": [0.05, 0, -0.1], "rotation": [0, 0.3, 0.5]},
        {"type": "move_linear", "frame": "tool", "offset": [0, 0, 0.02], "speed": 0.05},
        {"type": "move_linear", "rotation": [0, 0, 1]},
        {
            "type": "sequence",
            "steps": [
                {"type": "wait", "duration": 2.5},
                {
                    "type": "repeat",
                    "times": 4,
                    "steps": [
                        {"type": "wait", "duration": 0.5},
                        {"type": "jog_cartesian", "linear": [0, 0, 0.1], "duration": 1},
                    ],
                },
            ],
        },
        {"type": "home"},
        {"type": "stop"},
        {
            "type": "sequence",
            "steps": [
                {"type": "jog_joint", "joint": 2, "velocity": 0.2, "duration": 1.5},
                {"type": "pose", "name": "ready"},
                {"type": "gripper", "width": 0.0},
            ],
        },
    ],
)
def test_the_form_gives_back_the_action_it_was_given(modules: Page, action: dict[str, Any]) -> None:
    script = "return new m.ActionForm(a, { description: null }).value()"
    value = run(modules, "ui/action-form.js", script, action)
    given = ACTION.validate_json(json.dumps(action)).model_dump()
    assert _rounded(ACTION.validate_json(json.dumps(value)).model_dump()) == _rounded(given)


def _rounded(value: Any) -> Any:
    """Degrees are shown with two digits; that much may be lost."""
    if isinstance(value, float):
        return round(value, 3)
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return value


@pytest.mark.parametrize(
    ("ok", "problems", "title", "lines"),
    [
        (True, [], "Nothing is in the way. It takes 12.5 s.", []),
        (
            True,
            [(None, "slowed", "slowed near a singular position")],
            "It can be done, slowed down in places. It takes 12.5 s.",
            ["Slowed near a singular position (after 3 s)"],
        ),
        (
            False,
            [(2, "joint_limit", "joint 5 would pass its limit"), (3, "slowed", "slowed")],
            "It meets a limit:",
            ["Step 2: J5 would pass its limit (after 3 s)", "Step 3: Slowed (after 3 s)"],
        ),
    ],
)
def test_what_a_dry_run_found_in_plain_words(
    modules: Page,
    ok: bool,
    problems: list[tuple[int | None, str, str]],
    title: str,
    lines: list[str],
) -> None:
    found = [
        {"step": step, "time_s": 3.0, "kind": kind, "message": message}
        for step, kind, message in problems
    ]
    report = {"ok": ok, "duration_s": 12.5, "problems": found, "path": {}}
    said = run(modules, "ui/program-check.js", "return m.describeReport(a)", report)
    assert said["good"] is ok
    assert said["title"] == title
    assert [line["text"] for line in said["lines"]] == lines


def test_every_icon_and_text_that_is_named_exists() -> None:
    icons = set(re.findall(r'<symbol id="([\w-]+)"', (STATIC / "icons/icons.svg").read_text()))
    code = "\n".join(path.read_text() for path in SCRIPTS)
    html = (STATIC / "index.html").read_text()
    named = set(re.findall(r'(?:iconName: |icon\()"([\w-]+)"', code))
    named |= set(re.findall(r'data-icon="([\w-]+)"', html))
    named |= {"mode-" + mode for mode in ("disarmed", "armed", "moving", "holding", "stopped")}
    assert named <= icons


def test_core_knows_no_page_and_ui_opens_no_sockets() -> None:
    for path in SCRIPTS:
        code = path.read_text()
        if "core" in path.parts:
            assert not re.search(r"getElementById|querySelector|\.\./ui/|\.\./texts/", code), path
        if "ui" in path.parts:
            assert not re.search(r"new WebSocket|fetch\(|\.\./core/", code), path


def test_the_page_is_light() -> None:
    """What opening the page loads, as it travels (gzip), with the longest words: under 150 KB."""
    files = {STATIC / name for name in re.findall(r'(?:src|href)="static/([^"]+)"', HTML)}
    files |= {STATIC / "index.html", STATIC / "icons/icons.svg", STATIC / "core/jpeg-worker.js"}
    files |= set().union(*(imports(path) for path in files if path.suffix == ".js"))
    assert STATIC / "ui" / "dom.js" in files
    assert STATIC / "ui" / "manager" / "manager.js" not in files
    words = max(weight(imports(path)) for path in (STATIC / "texts").glob("??.js"))
    assert weight(files) + words < 150_000


def imports(script: Path) -> set[Path]:
    """A module and all that it imports at once; what it awaits later is not among it."""
    found, ahead = set(), [script]
    while ahead:
        if (path := ahead.pop()) not in found:
            found.add(path)
            named = re.findall(r'^(?:import|export|\}).* from "(\..+)";', path.read_text(), re.M)
            ahead += [(path.parent / name).resolve() for name in named]
    return found


def weight(files: set[Path]) -> int:
    return sum(len(gzip.compress(path.read_bytes())) for path in files)


def test_nothing_foreign_and_nothing_inline() -> None:
    html = (STATIC / "index.html").read_text()
    assert not re.search(r"\sstyle=|<style|\son\w+=|<script(?![^>]*\ssrc=)", html)
    for path in STATIC.rglob("*.*"):
        if path.suffix in (".webm", ".webp"):
            continue
        text = path.read_text().replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://\w", text), path
        assert "innerHTML" not in text, path
