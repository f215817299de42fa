"""The page's modules by themselves: no server behind them but one for static files."""

import gzip
import itertools
import json
import re
import struct
from pathlib import Path
from typing import Any, get_args

import pytest
from playwright.sync_api import Page

from app.config import DecodeSettings
from app.gateway.messages import CLIENT_MESSAGES, SERVER_MESSAGES
from app.link.actions import ACTION
from app.link.header import HEADER_SIZE, FrameHeader
from app.link.messages import COMMAND_TTL_MS, Doubt
from app.pipeline.types import Cause
from app.robot.controller import DOUBTS
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


def test_every_finding_of_the_check_has_words(modules: Page) -> None:
    codes = {"camera": ("denied", "none", "busy", "insecure", "unsupported", "odd")}
    codes |= {"socket": ("blocked",), "webgl": ("off",)}
    for what, problems in codes.items():
        for code in ("fine", *problems):
            finding = {"what": what, "code": code}
            said = run(modules, "ui/preflight.js", "return m.describeFinding(a)", finding)
            assert said["title"], finding
            assert bool(said["words"]) is (code != "fine"), finding


def test_the_check_finds_what_is_missing(modules: Page) -> None:
    # The server of these tests has no WebSockets, and nobody allows the camera here.
    script = "const all = []; await m.preflight((f) => all.push(f)); return all"
    found = {each["what"]: each["code"] for each in run(modules, "core/preflight.js", script)}
    assert list(found) == ["socket", "camera", "webgl"]
    assert found["socket"] == "blocked"
    assert found["camera"] in ("denied", "none")


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


PLAYED_LINK = """
const pace = new m.SendPace();
let now = 1000;
const show = (queueMs, times = 1) => {
    for (let n = 0; n < times; n += 1) {
        const sentAt = now;
        now += 150 + queueMs;
        pace.answered(sentAt, now);
    }
};
const showFor = (ms, queueMs = 0) => { for (const end = now + ms; now < end; ) show(queueMs); };
const seen = [];
const see = () => seen.push(pace.level);
"""


def test_fewer_and_smaller_frames_go_up_while_answers_are_late(modules: Page) -> None:
    def play(script: str) -> Any:
        return run(modules, "core/send-pace.js", f"{PLAYED_LINK} {script} return seen")

    last = run(modules, "core/send-pace.js", "return m.LEVELS.length - 1")
    assert play("show(0, 200); see();") == [0], "a long way is no queue"
    assert play("show(0, 9); show(500); show(0); see(); show(200, 2); see();") == [0, 1]
    assert play("show(0, 9); show(200, 100); see();") == [last]
    # Frames that were on their way before the change do not judge the new level.
    burst = "for (const n of [1, 2, 3, 4]) pace.answered(now, now + 400 + n);"
    assert play(f"show(0, 9); {burst} see();") == [1]
    # Up again, a step after three quick seconds; and back where the queue comes from.
    up = "show(0, 9); show(200, 4); see(); showFor(2500); see(); showFor(1000); see();"
    assert play(f"{up} showFor(3500); see();") == [2, 2, 1, 0]
    # What proves too much is tried ever more rarely.
    wait = (
        "{ const began = now; while (pace.level) show(0); seen.push(now - began); show(200, 2); }"
    )
    first, second, third = play(f"show(0, 9); show(200, 2); {wait * 3}")
    assert second > 1.5 * first
    assert third > 1.5 * second
    # Another connection may be another way: its first answers set what is quick.
    assert play("show(0, 9); pace.forget(); show(300, 40); see();") == [0]


def test_levels_lower_quality_then_size_then_rate_and_keep_what_recognition_needs(
    modules: Page,
) -> None:
    levels = run(modules, "core/send-pace.js", "return m.LEVELS")
    steps = [(each["intervalMs"], each["halved"]) for each in levels]
    assert steps == sorted(steps)
    for one, next_ in itertools.pairwise(levels):
        if one["halved"] == next_["halved"]:
            assert one["quality"] >= next_["quality"]
    slowest = levels[-1]["intervalMs"]
    assert 2 * slowest < COMMAND_TTL_MS, "one lost frame stops no motion"
    side = DecodeSettings().working_side
    script = "return a.map(([w, h]) => m.sentSize(w, h, true))"
    videos = [(640, 480), (1280, 720), (640, 360), (480, 640), (320, 240), (500, 358)]
    sizes = run(modules, "core/jpeg.js", script, videos)
    assert sizes == [[320, 240], [320, 180], [320, 180], [240, 320], [320, 240], [500, 358]]
    assert all(min(size) >= side for size in sizes)


def test_the_clock_takes_the_quickest_answer_and_knows_when_the_robot_showed_a_tick(
    modules: Page,
) -> None:
    script = """
    const link = new EventTarget();
    const pings = [];
    link.send = (type, fields) => pings.push([type, fields.t]);
    const say = (name, detail) => link.dispatchEvent(new CustomEvent(name, { detail }));
    const clock = new m.ServerClock(link);
    const known = [clock.when(500)];
    say("message", { type: "hello", tick: 1 });
    // The server's clock is 10000 ms ahead. There and back it took 40 ms, then 400 of which all but
    // 20 were on the way up, because frames waited there.
    const answer = (took, up) => {
        const now = performance.now();
        say("message", { type: "pong", t: now - took, tick: 10000 + now - took + up });
    };
    answer(40, 20);
    known.push(clock.when(500));
    // The robot's clock is 7000 ms behind the server's; its newest state is 30 ms old.
    say("message", { type: "robot", tick: 20000, age_ms: 30, state_tick: 12970 });
    const taken = performance.now() - 123;
    const wrong = () => clock.when(taken + 10000 - 7000) - taken;
    const errors = [wrong()];
    answer(400, 380);
    errors.push(wrong());
    const quickest = clock.roundTripMs;
    errors.push(clock.serverWhen(taken + 10000) - taken);
    say("message", { type: "pong", t: performance.now() + 5000, tick: 0 });
    say("message", { type: "robot", tick: 20000, age_ms: null });
    errors.push(wrong());
    say("state", { state: "waiting" });
    known.push(clock.when(500));
    return { known, errors, quickest, pings };
    """
    found = run(modules, "core/server-clock.js", script)
    assert found["known"] == [None, None, None]
    assert found["errors"] == pytest.approx([0, 0, 0, 0], abs=5)
    assert found["quickest"] == pytest.approx(40, abs=5)
    ((kind, sent),) = found["pings"]
    assert (kind, sent > 0) == ("ping", True)


LATENCY = """
// The server's clock is 1000 ms ahead of the page's, the robot's 7000 ms behind it.
const clock = { serverWhen: (tick) => tick - 1000, when: (tick) => tick + 7000 };
const latency = new m.Latency(clock);
const frame = (seq, at, timing_ms = { wait: 1, total: 9 }) => {
    const tick = 1000 + at + 5 + 3 + timing_ms.total;
    latency.frame({ seq, tick, timing_ms }, { capturedMs: at, sentAt: at + 5 }, at + 30);
};
const ms = (now, camera) => {
    const { parts, ...rest } = latency.reading(now, camera);
    return { ...Object.fromEntries(parts.map((part) => [part.name, part.ms])), ...rest };
};
"""


def measured(modules: Page, script: str) -> Any:
    return run(modules, "core/latency.js", LATENCY + script)


def test_the_parts_of_a_frame_s_time_add_up_to_its_total(modules: Page) -> None:
    script = """
    const nothing = ms(0);
    for (let n = 0; n < 20; n += 1) frame(n, 100 + n * 33);
    const before = ms(800);
    // Frame 10 was captured at 430 and its command went out at 447; the arm began at 458.
    const motion = { seq: 10, seq_tick: 458 - 7000 };
    latency.robot(motion, false, 800); // somebody else drives
    const others = ms(800).motion;
    for (let n = 0; n < 3; n += 1) latency.robot(motion, true, 800);
    latency.picture("wrist", { takenAt: 760, shownAt: 800 });
    return { nothing, before, others, after: ms(820) };
    """
    found = measured(modules, script)
    unknown = dict.fromkeys(("encode", "up", "wait", "recognise", "motion", "picture"))
    assert found["nothing"] == {**unknown, "total": None, "whole": False, "pictureAge": None}
    up = {"encode": 5, "up": 3, "wait": 1, "recognise": 8}
    assert found["before"] == {
        **unknown, **up, "total": 17, "whole": False, "pictureAge": None,
    }  # fmt: skip
    assert found["others"] is None
    assert found["after"] == {
        **up, "motion": 11, "picture": 40, "total": 68, "whole": True, "pictureAge": 60,
    }  # fmt: skip


def test_one_slow_frame_changes_no_median_and_what_is_old_is_forgotten(modules: Page) -> None:
    script = """
    for (let n = 0; n < 9; n += 1) frame(n, 100 + n * 33);
    frame(9, 397, { wait: 300, total: 500 });
    const slow = ms(500);
    // The newest picture is that of the view that is looked at, or any.
    latency.picture("wrist", { takenAt: 440, shownAt: 500 });
    latency.picture("scene", { takenAt: 480, shownAt: 520 });
    const ages = ["wrist", "scene", "3d"].map((name) => ms(530, name).pictureAge);
    const later = ms(3000);
    latency.forget();
    return { slow, ages, later, gone: ms(3000) };
    """
    found = measured(modules, script)
    assert (found["slow"]["wait"], found["slow"]["recognise"]) == (1, 8)
    assert found["ages"] == [90, 50, 50]
    assert found["later"]["total"] is None
    assert found["later"]["pictureAge"] == 2520
    assert found["gone"]["pictureAge"] is None


def test_a_motion_that_is_told_before_its_frame_is_measured_all_the_same(modules: Page) -> None:
    script = """
    const motion = { seq: 4, seq_tick: 150 - 7000 };
    latency.robot(motion, true, 150);
    frame(4, 100); // its command went out at 117
    latency.robot(motion, true, 200);
    latency.robot({ seq: null, seq_tick: null }, true, 250);
    const first = ms(200).motion;
    // Clocks that are known to some ms show no motion before its cause.
    latency.robot({ seq: 4, seq_tick: 110 - 7000 }, true, 300);
    // Long after, the time of the last motions is still true.
    return [first, ms(9000).motion];
    """
    assert measured(modules, script) == [33, 17]


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


def test_templates_are_plotted_at_one_scale_and_the_hand_never_leaves_the_plot(
    modules: Page,
) -> None:
    script = (
        "const place = m.placer([[0, 0], [40, 10]], 212, 112);"
        "return [[0, 0], [40, 10], [20, 5], [20, 10], [999, -999]].map(place)"
    )
    low, high, middle, above, far = run(modules, "ui/glass/projection.js", script)
    assert middle == [106, 56]
    assert low[0] == pytest.approx(12)
    assert high[0] == pytest.approx(200)
    assert high[1] < middle[1] < low[1], "up is up"
    assert (middle[1] - above[1]) / (high[0] - middle[0]) == pytest.approx(5 / 20)
    assert far == [206, 106]


FAKE_SOCKETS = """
const real = window.WebSocket;
const made = [];
window.WebSocket = class {
    static OPEN = 1;
    constructor() { this.readyState = 0; made.push(this); }
    close() { this.closed = true; }
    opened() { this.readyState = 1; this.onopen(); }
};
const socket = new m.ReconnectingSocket("ws://nowhere/");
const waits = [];
socket.addEventListener("state", ({ detail }) => {
    if (detail.state === "waiting") waits.push(detail.retryAt - performance.now());
});
const newest = () => made[made.length - 1];
"""


def test_a_socket_waits_longer_by_half_each_time_and_tries_at_once_when_the_network_is_back(
    modules: Page,
) -> None:
    script = """
    try {
        socket.open();
        for (let n = 0; n < 3; n += 1) {
            newest().onclose({ code: 1006 });
            await new Promise((go) => setTimeout(go, waits[n] + 30));
        }
        const tried = made.length;
        // "connecting", without a network: this try may hang for long
        window.dispatchEvent(new Event("online"));
        const again = made.length - tried;
        newest().opened();
        window.dispatchEvent(new Event("online"));
        socket.retryNow(); // open, and heard a moment ago
        const left = made.length - tried - again;
        socket.close();
        window.dispatchEvent(new Event("online"));
        return { waits, tried, again, left, after: made.length, gone: made.at(-2).closed };
    } finally {
        window.WebSocket = real;
    }
    """
    found = run(modules, "core/socket.js", FAKE_SOCKETS + script)
    for wait, middle in zip(found["waits"], (250, 375, 562.5), strict=True):
        assert 0.75 * middle < wait < 1.25 * middle
    assert (found["tried"], found["again"], found["left"], found["after"]) == (4, 1, 0, 5)
    assert found["gone"]


def test_an_open_socket_that_was_silent_is_tried_anew_when_asked(modules: Page) -> None:
    script = """
    const clock = performance.now.bind(performance);
    try {
        socket.open();
        newest().opened();
        performance.now = () => clock() + 2100;
        socket.retryNow();
        const tried = made.length;
        socket.close();
        return tried;
    } finally {
        performance.now = clock;
        window.WebSocket = real;
    }
    """
    assert run(modules, "core/socket.js", FAKE_SOCKETS + script) == 2


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
