"""How many frames go up, how large, and how good."""

import itertools
from typing import Any

from playwright.sync_api import Page

from app.config import DecodeSettings
from app.link.messages import COMMAND_TTL_MS
from tests.e2e.running import run

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
    # Frames that were on their way together were held up by one thing; that there is a queue is
    # seen by those after them. What was on its way before a change does not judge the new level.
    burst = "{ for (const n of [1, 2, 3, 4]) pace.answered(now, now + 400 + n); now += 405; }"
    assert play(f"show(0, 9); {burst} see(); show(0); {burst} see(); {burst} see();") == [0, 0, 1]
    # One that is held up now and then is no reason to stay low.
    hiccup = "show(0, 19); show(200);"
    assert play(f"show(0, 9); show(200, 2); see(); {hiccup * 2} see();") == [1, 0]
    often = "show(0, 3); show(60);"
    assert play(f"show(0, 9); show(200, 2); {often * 20} see();") == [1]
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


def test_the_interval_counts_from_the_beginning_of_one_frame_to_that_of_the_next(
    modules: Page,
) -> None:
    """However long packing takes: else a slow computer would send ever fewer."""
    script = """
    const pace = new m.SendPace();
    let now = 1000;
    const due = [pace.isDue(now)];
    pace.answered(now, now + 100);
    for (let n = 0; n < 20; n += 1) {
        now += 1000;
        pace.answered(now - 900, now);
    }
    due.push(pace.level + 1 === m.LEVELS.length);
    pace.begin(now);
    for (const after of [33, 49, 67]) due.push(pace.isDue(now + after));
    return due;
    """
    assert run(modules, "core/send-pace.js", script) == [True, True, False, False, True]


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
