"""The server's clock as the page knows it, and where a frame's time goes."""

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.e2e.running import run


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
    # The slow answer taken for true would be wrong by 180 ms.
    assert found["errors"] == pytest.approx([0, 0, 0, 0], abs=60)
    assert found["quickest"] == pytest.approx(40, abs=30)
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
