"""The timeline's words and the keeper of settings, by themselves."""

from typing import Any

import pytest
from playwright.sync_api import Page

from app.memory import KINDS, PersonSettings
from tests.e2e.running import STATIC, run

ICONS = (STATIC / "icons/icons.svg").read_text()
STATE = {
    "hello": {"session": "operator-1"},
    "galleries": [{"id": "a1", "name": "Ann", "shared": False}],
    "description": None,
}
STOP = {"category": "S1", "who": "operator-1", "by": "button", "reason": "it was (operator-1)"}
GESTURE = {
    "who": "operator-2", "gesture": "up", "gallery": "shared", "moves": True,
    "action": {"type": "jog_cartesian", "frame": "base", "linear": [0, 0, 0.1]},
}  # fmt: skip
WORDS: list[tuple[str, dict[str, Any], float | None, str, list[str], str | None]] = [
    ("started", {"version": "0.1"}, None, "The server started", ["0.1"], None),
    ("control", {"who": "operator-1", "before": None}, None, "Control taken", ["you"], None),
    ("control", {"who": "b", "before": "operator-1"}, None, "Control taken over", ["b"], None),
    ("control", {"who": None, "before": "b"}, None, "Control given back", ["b"], None),
    ("armed", {"who": "operator-1"}, None, "Armed", ["you"], None),
    ("disarmed", {"reason": "the lease ended"}, None, "Disarmed", [], "the lease ended"),
    ("gesture", GESTURE, 1.46, "“up”", ["up 10 cm/s", "operator-2", "1.5 s"], None),
    (
        "program", {**GESTURE, "moves": False}, None, "Program “up”",
        ["up 10 cm/s", "not obeyed", "operator-2"], None,
    ),
    ("keys", {"who": "operator-1", "presses": 2}, 4, "Driven by keys",
     ["2 presses", "you", "4 s"], None),
    ("hold", {"category": "S2", "doubt": "frozen", "reason": "x"}, None, "Held still",
     ["your webcam sends the same picture over and over; turn it off and on again"], None),
    ("hold", {"category": "S2", "doubt": None, "reason": "late"}, None, "Held still", [], "late"),
    ("stop", STOP, None, "Stop (S1)", ["by the STOP button", "you"], None),
    ("stop", {**STOP, "by": "robot", "who": None}, None, "Stop (S1)",
     ["by the robot itself"], "it was (operator-1)"),
    ("unconfirmed", {"who": "rest", "by": "rest"}, None, "A stop was not confirmed",
     ["by another program"], None),
    ("reset", {}, None, "Reset", [], None),
    ("fault", {"reason": "it stuck"}, 2.0, "Fault", ["2 s"], "it stuck"),
    ("robot_lost", {}, 0.4, "The robot fell silent", ["0.4 s"], None),
    ("robot_back", {}, None, "The robot speaks again", [], None),
    ("enrolled", {"gesture": "wave", "gallery": "a1"}, None, "“wave” taught", ["Ann"], None),
    ("changed", {"gesture": "wave", "gallery": "gone", "what": ["action", "samples"]}, None,
     "“wave” changed", ["somebody who is gone", "action", "pictures"], None),
    ("retired", {"gesture": "wave", "gallery": "shared", "how": "deleted"}, None,
     "“wave” deleted", [], None),
    ("retired", {"gesture": "wave", "gallery": "a1", "how": "inactive"}, None,
     "“wave” is not used any more", ["Ann"], None),
    ("gallery", {"gallery": "a1", "what": "made", "gestures": 10}, None, "Gallery made",
     ["Ann"], None),
    ("gallery", {"gallery": "a1", "what": "deleted"}, None, "Gallery deleted", [], None),
    ("sign_in", {"count": 1}, None, "1 wrong token was sent", [], None),
]  # fmt: skip


def test_every_kind_of_event_has_words_an_icon_and_a_group(modules: Page) -> None:
    assert {kind for kind, *_ in WORDS} == set(KINDS)
    script = "return a[0].map((event) => m.describeEvent(event, a[1]))"
    events = [{"kind": kind, "data": data, "duration_s": s} for kind, data, s, *_ in WORDS]
    said = run(modules, "ui/timeline/describe.js", script, [events, STATE])
    for told, (_, _, _, title, more, reason) in zip(said, WORDS, strict=True):
        assert (told["title"], told["more"], told.get("reason")) == (title, more, reason)
        assert f'<symbol id="{told["icon"]}"' in ICONS
    groups = run(modules, "ui/timeline/describe.js", "return Object.values(m.GROUPS).flat()")
    assert sorted(groups) == sorted(KINDS)
    # A page that is older than its server still says something.
    unknown = {"kind": "danced", "data": {}, "duration_s": None}
    assert run(
        modules, "ui/timeline/describe.js", "return m.describeEvent(...a).title", [unknown, STATE]
    ) == ("danced")


KEEPER = """
const kept = { speed: "0.5", fine: "no", large: "scene" };
const memory = { get: (name) => kept[name] ?? null, set: (name, value) => { kept[name] = value; } };
const server = { ann: { speed: 0.3, glass: true, source: null }, ben: {} };
const asked = [];
let away = false;
const failing = () => { if (away) throw Object.assign(new Error(), { status: 0 }); };
const api = {
    settings: async (who) => { asked.push(["get", who]); failing(); return { ...server[who] }; },
    changeSettings: async (who, changes) => {
        asked.push(["patch", who, changes]);
        failing();
        Object.assign(server[who], changes);
    },
};
const { Store } = await import("/static/core/store.js");
const hello = () => ({ role: "operator" });
const open = { state: "open" };
const store = new Store({ gallery: "shared", hello: hello(), connection: open });
const keeper = new m.SettingsKeeper(api, store, memory);
let loaded = 0;
keeper.addEventListener("loaded", () => { loaded += 1; });
const until = async (condition) => {
    for (let n = 0; n < 2000 && !condition(); n += 1) await new Promise((go) => setTimeout(go, 10));
};
const patches = () => asked.filter(([what]) => what === "patch");
"""


def keep(modules: Page, script: str) -> Any:
    return run(modules, "core/settings.js", KEEPER + script)


def test_choices_follow_their_person_and_stay_here_without_one(modules: Page) -> None:
    script = """
    keeper.set("speed", "0.7"); // nobody's
    await new Promise((go) => setTimeout(go, 700));
    const shared = asked.length;
    store.set({ gallery: "ann" });
    await until(() => loaded);
    const found = { ...kept };
    keeper.set("speed", "0.3"); // as it is
    keeper.set("speed", "0.4");
    keeper.set("speed", "0.45");
    keeper.set("fine", "yes");
    keeper.set("source", "again");
    keeper.set("first-ann", "{}");
    await until(() => patches().length);
    // At once, for whom they were made, when another person comes.
    keeper.set("glass", "folded");
    store.set({ gallery: "ben" });
    await until(() => loaded === 2);
    return { shared, found, patches: patches(), ann: server.ann, ben: server.ben, kept };
    """
    got = keep(modules, script)
    assert got["shared"] == 0
    assert got["found"] == {"speed": "0.3", "fine": "no", "large": "scene", "glass": "open"}
    assert got["patches"] == [
        ["patch", "ann", {"speed": 0.45, "fine": True}],
        ["patch", "ann", {"glass": False}],
    ]
    assert got["ann"] == {"speed": 0.45, "glass": False, "source": None, "fine": True}
    assert got["ben"] == {}
    assert got["kept"]["speed"] == "0.45"


def test_what_is_chosen_while_the_server_is_away_is_told_later(modules: Page) -> None:
    script = """
    store.set({ gallery: "ann" });
    await until(() => loaded);
    away = true;
    keeper.set("speed", "0.6");
    await until(() => patches().length);
    store.set({ connection: { state: "waiting" } });
    keeper.set("large", "wrist");
    await until(() => patches().length === 2);
    away = false;
    server.ann.fine = true; // chosen elsewhere meanwhile
    store.set({ hello: hello(), connection: open });
    await until(() => loaded === 2);
    return { ann: server.ann, kept };
    """
    got = keep(modules, script)
    assert got["ann"] == {
        "speed": 0.6, "large": "wrist", "fine": True, "glass": True, "source": None,
    }  # fmt: skip
    assert (got["kept"]["speed"], got["kept"]["fine"]) == ("0.6", "yes")


def test_an_observer_keeps_nothing_on_the_server(modules: Page) -> None:
    script = """
    store.set({ hello: { role: "observer" }, gallery: "ann" });
    await new Promise((go) => setTimeout(go, 600));
    return asked;
    """
    assert keep(modules, script) == []


def test_the_page_keeps_what_the_server_knows(modules: Page) -> None:
    script = "return Object.keys(m.FIELDS)"
    assert set(run(modules, "core/settings.js", script)) == set(PersonSettings.model_fields)


@pytest.mark.parametrize(
    ("driving", "now", "kept", "expected"),
    [
        (False, (0.3, False), ("1", "no"), (1, False)),
        (False, (1, False), (None, None), (1, False)),
        (True, (0.3, False), ("1", "no"), (0.3, False)),
        (True, (1, True), ("0.5", "no"), (1, True)),
        (True, (0.8, False), ("0.5", "yes"), (0.5, True)),
    ],
)
def test_settings_that_arrive_make_no_arm_faster_that_is_driven(
    modules: Page,
    driving: bool,
    now: tuple[float, bool],
    kept: tuple[str | None, str | None],
    expected: tuple[float, bool],
) -> None:
    script = """
    const [driving, [speed, fine], [keptSpeed, keptFine]] = a;
    const memory = { get: (name) => (name === "speed" ? keptSpeed : keptFine) };
    const robot = { controller: driving ? "me" : null };
    const state = { connection: { state: "open" }, hello: { session: "me" }, robot, speed, fine };
    const safe = m.safeSpeed(state, memory);
    return [safe.speed, safe.fine];
    """
    assert run(modules, "ui/speed.js", script, [driving, now, kept]) == list(expected)
