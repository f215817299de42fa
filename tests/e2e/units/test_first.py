"""The first minutes without a page: advice, holding still, the order of things, verdicts."""

from typing import Any

import pytest
from playwright.sync_api import Page

from app.gestures.hand.poses import POSES
from tests.e2e.running import run

pytestmark = pytest.mark.e2e

SIZE = {"width": 640, "height": 480}
SEEN = {"roi": [220, 100, 180, 240], "still": True, "motion": 0.002, "mask": {"mode": "threshold"}}
LIT = {"mean": 150, "burnt": 0, "hand": 140, "around": 200, "contrast": 90}


def judge(page: Page, measured: Any, frame: Any) -> dict[str, str]:
    script = "return m.judge(a.measured, a.frame, a.size)"
    given = {"measured": measured, "frame": frame, "size": SIZE}
    return {line["what"]: line["code"] for line in run(page, "ui/first/advice.js", script, given)}


GOOD = {"light": "good", "distance": "good", "background": "good", "still": "good"}
NO_HAND = {"distance": "none", "background": "wait", "still": "wait"}


@pytest.mark.parametrize(
    ("measured", "frame", "changed"),
    [
        ({}, {}, {}),
        ({"mean": 30}, {}, {"light": "dark"}),
        ({"burnt": 0.5}, {}, {"light": "glare"}),
        ({"hand": 40}, {}, {"light": "behind"}),
        ({"contrast": 6}, {}, {"background": "faint"}),
        ({}, {"roi": [280, 200, 70, 90]}, {"distance": "far"}),
        ({}, {"roi": [150, 10, 300, 465]}, {"distance": "near"}),
        ({}, {"roi": [0, 100, 180, 240]}, {"distance": "cut"}),
        ({}, {"roi": [300, 0, 180, 240]}, {"distance": "cut"}),
        ({}, {"roi": [20, 100, 120, 200]}, {"distance": "aside"}),
        ({}, {"still": False, "motion": 0.2}, {"still": "moving"}),
        # All hands tremble.
        ({}, {"still": False, "motion": 0.015}, {}),
        ({}, {"mask": {"mode": "learned"}}, {"background": "busy"}),
        ({}, {"doubt": "two_hands", "roi": None}, {**NO_HAND, "background": "two"}),
        ({}, {"reason": "two hands in the picture: show one"}, {"background": "two"}),
        ({}, {"roi": None}, NO_HAND),
        (None, {}, {"light": "wait", "background": "wait"}),
        ({}, None, {"distance": "wait", "background": "wait", "still": "wait"}),
    ],
)
def test_what_is_seen_becomes_advice(
    modules: Page, measured: Any, frame: Any, changed: dict[str, str]
) -> None:
    seen = None if frame is None else {**SEEN, **frame}
    lit = None if measured is None else {**LIT, **measured}
    assert judge(modules, lit, seen) == {**GOOD, **changed}


def test_every_advice_and_every_starter_sign_has_words(modules: Page) -> None:
    words = run(modules, "texts/texts.js", "return JSON.parse(JSON.stringify(m.texts.first))")
    codes = {
        "light": {"wait", "dark", "glare", "behind", "good"},
        "distance": {"wait", "none", "cut", "far", "near", "aside", "good"},
        "background": {"wait", "two", "faint", "busy", "good"},
        "still": {"wait", "moving", "good"},
    }
    assert {what: set(told) for what, told in words["check"]["advice"].items()} == codes
    assert set(words["signs"]) == set(POSES)


def test_the_picture_is_measured_in_the_hand_and_round_it(modules: Page) -> None:
    # Ten by ten: a dark hand in the middle of a white room.
    script = """
    const pixels = new Uint8ClampedArray(400).fill(255);
    for (let row = 3; row < 8; row += 1)
        for (let column = 3; column < 7; column += 1)
            pixels.fill(50, 4 * (10 * row + column), 4 * (10 * row + column) + 3);
    const box = [0.3, 0.3, 0.4, 0.5];
    return [m.measure(pixels, 10, 10, box), m.measure(pixels, 10, 10), m.boxOf(a.frame, a.size)];
    """
    given = {"frame": SEEN, "size": SIZE}
    found, bare, box = run(modules, "ui/first/advice.js", script, given)
    assert found["mean"] == pytest.approx(255 - 0.2 * 205)
    assert found["burnt"] == pytest.approx(0.8)
    assert (found["hand"], found["around"]) == pytest.approx((50, 255))
    assert found["contrast"] == pytest.approx(205 * 3**0.5)
    assert (bare["hand"], bare["contrast"]) == (None, None)
    assert box == pytest.approx([220 / 640, 100 / 480, 180 / 640, 240 / 480])


HOLD = """
const hold = new m.HoldStill({ holdMs: 1000, changeMs: 200, graceMs: 200 });
let now = 0;
const seen = [];
const show = (ms, hand, still) => {
    for (const end = now + ms; now < end; now += 50) seen.push(hold.update(now, { hand, still }));
    return seen[seen.length - 1];
};
"""


def test_a_hand_that_does_not_change_is_not_taken_for_the_next_gesture(modules: Page) -> None:
    def play(script: str) -> Any:
        return run(modules, "ui/first/hold.js", HOLD + script)

    # It was up and still before: nothing counts until it has moved for a moment.
    assert play("return show(5000, true, true).phase") == "change"
    twitch = "show(500, true, true); show(100, true, false); return show(2000, true, true).phase"
    assert play(twitch) == "change"
    last = play("show(300, true, false); return show(500, true, true)")
    assert last["phase"] == "hold"
    assert 0.4 < last["share"] < 0.6
    assert last["due"] == 1
    # Pictures are due one after another, and all of them at the end.
    dues = play("show(300, false, false); show(1300, true, true); return seen.map((s) => s.due)")
    assert sorted(dues) == dues
    assert set(dues) == {0, 1, 2, 3}
    # After the next one has begun the same hand counts no more.
    after = "show(300, false, false); show(1300, true, true); hold.next();"
    assert play(f"{after} return show(3000, true, true).phase") == "change"
    assert play(f"{after} show(300, true, false); return show(1300, true, true).phase") == "taken"


def test_a_short_tremble_is_no_break_and_a_real_one_begins_anew(modules: Page) -> None:
    def play(script: str) -> Any:
        return run(modules, "ui/first/hold.js", f"{HOLD} show(300, false, false); {script}")

    tremble = "show(500, true, true); show(100, true, false); return show(450, true, true)"
    assert play(tremble)["phase"] in ("hold", "taken")
    assert play(tremble)["share"] > 0.9
    broken = play("show(800, true, true); show(400, true, false); return show(300, true, true)")
    assert broken["share"] < 0.4
    assert broken["due"] == 0
    # A page that slept does not know what the hand did.
    slept = "show(500, true, true); now += 5000; return show(100, true, true)"
    assert play(slept)["share"] < 0.2


GESTURES = [
    {"id": "a", "name": "forward", "action": {"type": "jog_cartesian", "linear": [0.1, 0, 0]}},
    {"id": "b", "name": "back", "action": {"type": "jog_cartesian", "linear": [-0.1, 0, 0]}},
    {"id": "c", "name": "up", "action": {"type": "jog_cartesian", "linear": [0, 0, 0.1]}},
    {"id": "d", "name": "stop", "action": {"type": "stop"}},
    {"id": "e", "name": "old", "action": {"type": "home"}, "active": False},
]
PLAN = "const p = { ...m.FRESH, ...a.progress };"


def step(page: Page, *, asked: bool = True, taught: str = "", **given: Any) -> str:
    gestures = [{**gesture, "taught": gesture["id"] in taught} for gesture in GESTURES]
    source = given.pop("source", {"state": "running", "kind": "camera"})
    galleries = given.pop("galleries", [])
    gallery = given.pop("gallery", "anna")
    state = {"source": source, "galleries": galleries, "gallery": gallery, "gestures": gestures}
    given = {"state": state, "progress": given, "asked": asked}
    return str(
        run(page, "ui/first/plan.js", f"{PLAN} return m.stepNow(a.state, p, a.asked)", given)
    )


def test_where_somebody_stands_follows_from_what_was_done(modules: Page) -> None:
    assert step(modules, source={"state": "none"}) == "source"
    assert step(modules, source={"state": "error"}, checked=True) == "source"
    assert step(modules, asked=False) == "whose"
    assert step(modules, asked=False, galleries=None) == "check", "one gallery: nothing to ask"
    assert step(modules) == "check"
    assert step(modules, checked=True) == "teach"
    assert step(modules, checked=True, taught="ab") == "teach"
    assert step(modules, checked=True, taught="ab", past=["c", "d"]) == "drive"
    assert step(modules, checked=True, taught="abcd") == "drive", "what is retired is not taught"
    assert step(modules, checked=True, taught="abcd", again=True) == "teach"
    assert step(modules, checked=True, taught="abcd", done=True) == "done"
    assert step(modules, checked=True, gallery="shared") == "drive", "other people's gestures stay"
    assert step(modules, checked=True, gallery="shared", galleries=None) == "teach"
    drawn = {"state": "running", "kind": "synthetic"}
    assert step(modules, source=drawn, asked=False) == "drive", "the drawn hand is nobody's"
    keys = {"state": "running", "kind": "keys"}
    assert step(modules, source=keys, asked=False) == "done", "who drives by keys shows no hand"


def test_a_returning_person_is_known_by_this_browser_or_by_their_gallery(modules: Page) -> None:
    def returning(gallery: str, taught: str, **progress: Any) -> bool:
        gestures = [{**gesture, "taught": gesture["id"] in taught} for gesture in GESTURES]
        state = {"gallery": gallery, "gestures": gestures}
        given = {"state": state, "progress": progress}
        script = f"{PLAN} return m.isReturning(a.state, p)"
        return bool(run(modules, "ui/first/plan.js", script, given))

    assert not returning("shared", "")
    assert not returning("shared", "abcd"), "somebody taught it, who knows who"
    assert returning("shared", "", done=True)
    assert returning("anna", "abcd")
    assert not returning("anna", "abc")
    assert not returning("anna", "abcd", again=True)


def test_progress_that_was_tampered_with_is_none(modules: Page) -> None:
    script = "return a.map((text) => m.readProgress(text))"
    kept = ['{"checked":true,"past":["a",7],"done":"yes"}', "{", "null", "7", None]
    first, *others = run(modules, "ui/first/plan.js", script, kept)
    assert (first["checked"], first["past"], first["done"]) == (True, ["a"], False)
    fresh = run(modules, "ui/first/plan.js", "return { ...m.FRESH }")
    assert others == [fresh] * 4


def test_the_guided_drive_asks_for_one_thing_after_another(modules: Page) -> None:
    def task(robot: Any, drives: bool = True, **progress: Any) -> str:
        robot = None if robot is None else {"online": True, "fault": None, **robot}
        given = {"robot": robot, "drives": drives, "progress": progress}
        script = f"{PLAN} return m.driveTask(a.robot, a.drives, p)"
        return str(run(modules, "ui/first/plan.js", script, given))

    assert task(None) == "wait"
    assert task({"mode": "faulted", "fault": "gone"}) == "wait"
    disarmed = {"mode": "disarmed", "armed": False, "controller": None}
    assert task(disarmed, drives=False) == "control"
    assert task({**disarmed, "controller": "anna"}, drives=False) == "ask"
    assert task(disarmed) == "arm"
    assert task({"mode": "armed", "armed": True}) == "show"
    assert task({"mode": "moving", "armed": True}, moved=["up"]) == "show"
    assert task({"mode": "moving", "armed": True}, moved=["up", "left"]) == "stop"
    assert task({"mode": "stopped", "armed": False}) == "reset", "the stop sign was taught just now"
    assert task({"mode": "stopped"}, moved=["up", "left"], stopped=True) == "reset"
    assert task(disarmed, moved=["up", "left"], stopped=True) == "done"


def test_what_was_learnt_needs_a_gesture_that_moved_the_arm(modules: Page) -> None:
    def moved_by(robot: Any, gesture: Any, drives: bool = True) -> Any:
        given = {"state": {"robot": robot, "gesture": gesture}, "drives": drives}
        return run(modules, "ui/first/plan.js", "return m.movedBy(a.state, a.drives)", given)

    moving = {"mode": "moving", "action": {"type": "home"}}
    up = {"gesture": "up", "phase": "hold"}
    assert moved_by(moving, up) == "up"
    assert moved_by(moving, up, drives=False) is None
    assert moved_by({"mode": "armed"}, up) is None
    assert moved_by(moving, {"gesture": "up", "phase": "end"}) is None
    assert moved_by(None, up) is None

    def learn(mode: str, seen: str | None, **progress: Any) -> tuple[Any, Any]:
        given = {"robot": {"mode": mode}, "seen": seen, "progress": progress}
        script = f"{PLAN} const n = m.learn(a, a.seen, p); return [n.moved, n.stopped]"
        moved, stopped = run(modules, "ui/first/plan.js", script, given)
        return moved, stopped

    assert learn("moving", "up") == (["up"], False)
    assert learn("moving", "up", moved=["up"]) == (["up"], False)
    assert learn("moving", None) == ([], False)
    assert learn("stopped", None) == ([], False), "too early: nothing moved yet"
    assert learn("stopped", None, moved=["up", "left"]) == (["up", "left"], True)


def test_two_different_ways_to_move_are_suggested_and_never_the_stop(modules: Page) -> None:
    def suggest(gestures: Any, *moved: str) -> str | None:
        script = "const g = m.suggested(a.gestures, a.moved); return g && g.name"
        found = run(
            modules, "ui/first/plan.js", script, {"gestures": gestures, "moved": list(moved)}
        )
        return None if found is None else str(found)

    assert suggest(GESTURES) == "up"
    assert suggest(GESTURES, "up") == "forward"
    assert suggest(GESTURES, "forward") == "up"
    assert suggest(GESTURES, "up", "forward") == "back", "the same axis, if nothing else is left"
    assert suggest([GESTURES[3], GESTURES[4]]) is None


ROUND = """
const all = a.gestures.map((gesture) => ({ ...gesture, taught: a.taught.includes(gesture.id) }));
const round = new m.Round(all, { past: a.past, again: false });
const seen = [];
const see = () => seen.push(round.current && round.current.id);
"""


def test_the_round_goes_on_with_what_is_open_and_back_to_any(modules: Page) -> None:
    def play(script: str, taught: str = "", past: str = "") -> Any:
        given = {"gestures": GESTURES, "taught": list(taught), "past": list(past)}
        return run(modules, "ui/first/round.js", f"{ROUND} {script} return seen", given)

    every = "while (!round.isOver) { see(); round.settle('taught'); }"
    assert play(every) == ["a", "b", "c", "d"]
    assert play(every, taught="a", past="c") == ["b", "d"]
    # Back is the one before, and what was left open is come back to.
    back = f"round.settle('taught'); round.back(); see(); {every}"
    assert play(back) == ["a", "a", "b", "c", "d"]
    assert play(f"round.goTo('c'); see(); round.settle('skipped'); {every}") == ["c", "d", "a", "b"]
    able = "seen.push(round.canGoBack, round.canRedo);"
    assert play(f"{able} round.back(); round.redo(); see();") == [False, False, "a"]
    count = "seen.push(round.count('taught'), round.count('skipped'));"
    redo = "round.settle('taught'); round.settle('skipped'); round.redo(); see();"
    assert play(f"{redo} {count}") == ["b", 1, 0]
    kept = "round.settle('taught'); round.back(); round.settle('skipped'); see();"
    assert play(f"{kept} {count}") == ["b", 1, 0], "skipped, it stays as it was taught"
    assert play(every, taught="abcd") == []


def test_a_check_becomes_a_verdict(modules: Page) -> None:
    def verdict(images: list[str | None], *confusions: dict[str, Any]) -> Any:
        answer = {
            "images": [
                {"accepted": problem is None, "problem": problem, "reason": f"it is {problem}"}
                for problem in images
            ],
            "confusions": [{"active": True, "advice": [], **one} for one in confusions],
        }
        return run(modules, "ui/first/verdict.js", "return m.verdict(a, 'own')", answer)

    good = verdict([None, "blurred", None])
    assert (good["good"], good["usable"], good["code"]) == (True, True, "good")
    bad = verdict(["blurred", "no_wrist", "blurred"])
    assert (bad["good"], bad["usable"]) == (False, False)
    assert (bad["code"], bad["reason"]) == ("blurred", "it is blurred")
    advice = [{"code": "add_photos", "message": "more"}, {"code": "show_thumb", "message": "thumb"}]
    left = {"id": "l", "gesture": "left", "level": "likely", "advice": advice}
    own = {"id": "own", "gesture": "up", "level": "likely"}
    near = {"id": "n", "gesture": "near", "level": "possible"}
    weak = verdict([None], own, near, left)
    assert (weak["good"], weak["usable"]) == (False, True)
    assert (weak["code"], weak["other"], weak["reason"]) == ("like", "left", "thumb")
    fine = verdict([None], own, near)
    assert (fine["good"], fine["code"], fine["other"]) == (True, "near", "near")
    assert verdict([None], {**left, "active": False})["good"], "what is retired is not matched"


def test_who_means_another_sign_may_keep_it(modules: Page) -> None:
    sign = {"code": "count", "seen": 2, "asked": 1, "stretch": [], "bend": ["middle"]}
    unlike = {"accepted": False, "problem": "not_the_sign", "reason": "two", "sign": sign}
    blurred = {"accepted": False, "problem": "blurred", "reason": "blurred", "sign": None}
    script = "return [m.verdict(a, 'own'), m.accepted(a, ['x', 'y', 'z'])]"
    answer = {"images": [unlike, blurred, unlike], "confusions": []}
    found, kept = run(modules, "ui/first/verdict.js", script, answer)
    assert (found["good"], found["usable"], found["code"]) == (False, True, "not_the_sign")
    assert found["sign"] == sign
    assert kept == ["x", "z"]
    good = {"accepted": True, "problem": None, "reason": None, "sign": None}
    answer = {"images": [unlike, good, unlike], "confusions": []}
    found, kept = run(modules, "ui/first/verdict.js", script, answer)
    assert (found["good"], kept) == (True, ["y"])


BURST = """
const asked = [];
const signs = [];
let saved = null;
const saving = new Promise((go) => { saved = go; });
const act = {
    check: async (pictures, sign) => {
        asked.push(["check", pictures.length]);
        signs.push(sign);
        return a;
    },
    save: async (gesture, pictures) => { asked.push([gesture.id, pictures.length]); await saving; },
};
let taken = 0;
const burst = new m.Burst(async () => ++taken, act);
let now = 0;
const show = (ms, still) => {
    const end = now + ms;
    let said;
    for (; now < end; now += 50) said = burst.update(now, { hand: true, still });
    return said;
};
const up = () => { show(300, false); return show(1300, true).phase; };
"""
ANSWER = {
    "images": [
        {"accepted": True, "problem": None},
        {"accepted": False, "problem": "blurred"},
        {"accepted": True, "problem": None},
    ],
    "confusions": [],
}


def test_a_burst_saves_what_was_accepted_and_the_next_is_checked_after_it(modules: Page) -> None:
    script = """
    const phases = [up()];
    const first = await burst.judge({ id: "one" }, "up");
    burst.save({ id: "one" }, first.pictures, () => {});
    burst.next();
    phases.push(up());
    let over = false;
    const second = burst.judge({ id: "two" }).then(() => { over = true; });
    await new Promise((go) => setTimeout(go, 20));
    const before = [asked.length, over];
    saved();
    await second;
    const images = first.taken.map(({ picture, image }) => [picture, image.accepted]);
    return { phases, pictures: first.pictures, images, before, asked, signs, taken };
    """
    found = run(modules, "ui/first/burst.js", BURST + script, ANSWER)
    assert found["phases"] == ["taken", "taken"]
    assert found["pictures"] == [1, 3]
    assert found["images"] == [[1, True], [2, False], [3, True]]
    assert found["signs"] == ["up", None]
    assert found["before"] == [2, False]
    assert found["asked"] == [["check", 3], ["one", 2], ["check", 3]]
    assert found["taken"] == 6


def test_a_hold_that_breaks_and_a_person_who_goes_elsewhere_leave_nothing_behind(
    modules: Page,
) -> None:
    script = """
    show(300, false); show(800, true); show(400, false); show(1300, true);
    const judged = burst.judge({ id: "one" });
    burst.next();
    const none = await judged;
    return { none, asked, taken };
    """
    found = run(modules, "ui/first/burst.js", BURST + script, ANSWER)
    assert found == {"none": None, "asked": [], "taken": 5}


KEEPER = """
const sent = [];
const kept = new Map(Object.entries(a.kept || {}));
const memory = { get: (key) => kept.get(key) ?? null, set: (key, value) => kept.set(key, value) };
const store = {
    state: { galleryVersion: 0 },
    set(patch) { this.state = { ...this.state, ...patch }; },
};
const link = { send: (type, fields) => { sent.push([type, fields.gallery]); return true; } };
const shared = { id: "shared", name: "shared", shared: true };
const api = {
    galleries: async () => {
        if (a.status) throw Object.assign(new Error(), { status: a.status });
        return [shared, { id: "g1", name: "Anna" }, { id: "g2", name: "Ben" }];
    },
    gestures: async (gallery) => [{ name: `of ${gallery}` }],
    createGallery: async () => ({ id: "g2" }),
};
const keeper = new m.GalleryKeeper(link, api, store, memory);
let lost = 0;
keeper.addEventListener("lost", () => { lost += 1; });
const settled = () => new Promise((go) => setTimeout(go));
"""
TOLD = """
await settled();
const { gallery, galleries, gestures } = store.state;
const of = gestures.map(({ name }) => name);
const there = galleries && galleries.length;
return { gallery, there, of, sent, lost, kept: memory.get("gallery") };
"""


def test_whose_gestures_are_used_is_said_after_each_hello_and_remembered(modules: Page) -> None:
    def play(script: str, **given: Any) -> Any:
        return run(modules, "core/galleries.js", f"{KEEPER} {script} {TOLD}", given)

    bare = play("await keeper.greeted();")
    assert (bare["gallery"], bare["there"], bare["sent"]) == ("shared", 3, [])
    assert bare["kept"] is None
    anna = {"kept": {"gallery": "g1"}}
    back = play("await keeper.greeted(); await keeper.greeted();", **anna)
    assert back["sent"] == [["use_gallery", "g1"]] * 2
    assert (back["gallery"], back["of"]) == ("g1", ["of g1"])
    watching = play("store.set({ hello: { role: 'observer' } }); await keeper.greeted();", **anna)
    assert watching["sent"] == []
    chosen = play("await keeper.choose('g1');")
    assert (chosen["sent"], chosen["kept"]) == ([["use_gallery", "g1"]], "g1")
    made = play("await keeper.create('Ben');", **anna)
    assert (made["gallery"], made["kept"], made["of"]) == ("g2", "g2", ["of g2"])
    anybody = play("await keeper.greeted(); await keeper.choose('shared');", **anna)
    assert anybody["sent"][-1] == ["use_gallery", "shared"]


def test_a_gallery_that_is_gone_gives_way_to_the_shared_one_and_a_late_message_does_not(
    modules: Page,
) -> None:
    def play(script: str, **given: Any) -> Any:
        given.setdefault("kept", {"gallery": "g1"})
        return run(modules, "core/galleries.js", f"{KEEPER} {script} {TOLD}", given)

    greeted = "await keeper.greeted();"
    unknown = play(f"{greeted} keeper.refused({{ code: 'not_found' }});")
    assert (unknown["gallery"], unknown["kept"], unknown["lost"]) == ("shared", "", 1)
    # Sent before the server heard what this page wants, and then the answer.
    late = "keeper.heard({ gallery: 'shared' });"
    answered = "keeper.heard({ gallery: 'g1' });"
    assert play(f"{greeted} {late}")["gallery"] == "g1"
    deleted = play(f"{greeted} {late} {answered} {late}")
    assert (deleted["gallery"], deleted["of"], deleted["lost"]) == ("shared", ["of shared"], 1)
    # Another error is somebody else's.
    other = play(f"{greeted} {answered} keeper.refused({{ code: 'not_found' }});")
    assert (other["gallery"], other["lost"]) == ("g1", 0)


def test_a_server_without_galleries_has_the_shared_one(modules: Page) -> None:
    def play(status: int) -> Any:
        given = {"kept": {"gallery": "g1"}, "status": status}
        return run(modules, "core/galleries.js", f"{KEEPER} await keeper.greeted(); {TOLD}", given)

    old = play(404)
    assert (old["gallery"], old["there"]) == ("shared", None)
    assert old["of"] == ["of shared"]
    assert play(503)["gallery"] == "g1", "that passes"


def test_no_step_is_shown_before_the_gestures_of_who_was_chosen_are_here(modules: Page) -> None:
    script = """
    const source = { state: "none" };
    const state = { gesturesState: "loading", gestures: [], galleries: null, source };
    const store = { state, watch: () => {} };
    const shown = [];
    const sheets = {
        show: (name) => { shown.push(name); return document.createElement("div"); },
    };
    let kept = {};
    const progress = { get: () => ({ past: [], ...kept }), set: (next) => { kept = next; } };
    const first = new m.FirstMinutes({
        host: document.documentElement, store, sheets, progress, act: { isChosen: () => true },
    });
    await first.open();
    await new Promise((done) => setTimeout(done, 500));
    const before = [...shown];
    state.gesturesState = "ready";
    while (!shown.length) await new Promise((done) => setTimeout(done, 20));
    return [before, shown];
    """
    assert run(modules, "ui/first/flow.js", script) == [[], ["first"]]
