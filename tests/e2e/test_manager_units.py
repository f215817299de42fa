"""The gesture manager's modules by themselves: no server behind them but one for static files."""

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.e2e.running import run

GESTURES = """
const gesture = (id, name, samples, more = {}) => ({
    id, name, action: { type: "home" }, active: true, version: 1, gallery: "shared", taught: true,
    samples: samples.length, sample_ids: samples, updated: "1", ...more,
});
const store = await (async () => {
    const { Store } = await import("/static/core/store.js");
    return new Store({
        gestures: [gesture("g1", "Two", ["s1", "s2"]), gesture("g2", "Three", ["s3"], { active: false })],
        gesturesState: "ready",
        description: null,
    });
})();
const done = [];
const act = Object.fromEntries(
    ["rename", "retire", "deleteSample", "moveSample"].map((name) => [
        name,
        async (...given) => {
            done.push([name, ...given]);
            if (given.includes("taken")) throw Object.assign(new Error("taken"), { status: 409 });
            return { change: `c${done.length}` };
        },
    ]),
);
const told = [];
const settled = () => new Promise((go) => setTimeout(go, 300));
const { content, close } = m.managerContent({
    store, act, templateUrl: (id, version, sample = 0) => `data:,${id}-${version}-${sample}`,
    told: (text, changes) => told.push([text, ...changes]), edit: (id) => done.push(["edit", id]),
});
document.body.replaceChildren(...content);
const row = (id) => document.querySelector(`#managed > [data-id="${id}"]`);
const press = (root, name) =>
    [...root.querySelectorAll("button")].find((one) => (one.getAttribute("aria-label") || one.textContent).startsWith(name)).click();
"""  # noqa: E501


def manager(page: Page, script: str) -> Any:
    return run(page, "ui/manager/manager.js", GESTURES + script)


def test_every_gesture_has_a_row_that_says_what_it_is(modules: Page) -> None:
    script = """return [...document.querySelectorAll("#managed > li")].map((one) => [
        one.querySelector(".managed-name").textContent,
        one.querySelector(".quiet").textContent,
        one.classList.contains("is-retired"),
        [...one.querySelectorAll(".managed-tools button")].map((b) => b.getAttribute("aria-label")),
    ]);"""
    assert manager(modules, script) == [
        [
            "Two",
            "go home",
            False,
            ["2 pictures of “Two”", "Rename “Two”", "Retire “Two”", "Change “Two”"],
        ],
        [
            "Three",
            "Retired · go home",
            True,
            ["1 picture of “Three”", "Rename “Three”", "Bring “Three” back", "Change “Three”"],
        ],
    ]


def test_a_picture_is_chosen_then_deleted_or_moved(modules: Page) -> None:
    script = """
    press(row("g1"), "2 pictures");
    const none = row("g1").querySelector(".sample-tools");
    row("g1").querySelector('[data-sample="s2"]').click();
    const pressed = row("g1").querySelector('[data-sample="s2"]').getAttribute("aria-pressed");
    press(row("g1"), "Delete picture 2");
    press(row("g1"), "Move picture 2");
    press(row("g2"), "1 picture");
    row("g2").querySelector('[data-sample="s3"]').click();
    await settled();
    return [none, pressed, row("g2").querySelector(".sample-tools"), done, told];
    """
    none, pressed, last, done, told = manager(modules, script)
    assert (none, pressed, last) == (None, "true", None)
    assert done == [["deleteSample", "g1", "s2"], ["moveSample", "g1", "s2", "g2"]]
    assert told == [
        ["A picture of “Two” is deleted.", "c1"],
        ["A picture of “Two” belongs to “Three” now.", "c2"],
    ]


def test_a_gesture_is_renamed_retired_and_brought_back(modules: Page) -> None:
    script = """
    press(row("g1"), "Rename");
    const field = row("g1").querySelector("form input");
    const focused = document.activeElement === field;
    field.value = "taken";
    row("g1").querySelector("form").requestSubmit();
    await settled();
    const refused = [document.querySelector("#manager-problem").textContent, field.isConnected];
    field.value = " Peace ";
    row("g1").querySelector("form").requestSubmit();
    press(row("g1"), "Retire");
    press(row("g2"), "Bring");
    await settled();
    return [focused, refused, field.isConnected, done, told.map(([text]) => text)];
    """
    focused, refused, connected, done, told = manager(modules, script)
    assert (focused, refused, connected) == (True, ["taken", True], False)
    assert done[1:] == [
        ["rename", "g1", "Peace"],
        ["retire", "g1", False],
        ["retire", "g2", True],
    ]
    assert told[0] == "“Two” is called “Peace” now."
    assert len(told) == 3


def test_what_is_unfolded_stays_so_and_keeps_the_focus(modules: Page) -> None:
    script = """
    press(row("g1"), "2 pictures");
    row("g1").querySelector('[data-sample="s2"]').focus();
    const gestures = [gesture("g1", "Two", ["s2"]), gesture("g2", "Three", ["s3"])];
    store.set({ gestures });
    await settled();
    const before = document.activeElement.dataset.sample;
    gestures[1] = gesture("g3", "Four", ["s4"]);
    store.set({ gestures: [...gestures] });
    await settled();
    const open = !row("g1").querySelector(".managed-body").hidden;
    const kept = document.activeElement.dataset.sample;
    close();
    store.set({ gestures: [] });
    await settled();
    return [open, before, kept, row("g2"), Boolean(row("g3"))];
    """
    assert manager(modules, script) == [True, "s2", "s2", None, True]


MATRIX: dict[str, Any] = {
    "gestures": [
        {"id": "a", "name": "Two", "samples": 8, "asked": 8},
        {"id": "b", "name": "Three", "samples": 4, "asked": 4},
        {"id": "c", "name": "Fist", "samples": 1, "asked": 0},
    ],
    "counts": [[5, 2, 0], [0, 4, 0], [0, 0, 0]],
    "rejected": [1, 0, 0],
    "untested": ["c"],
    "worst": None,
}


@pytest.mark.parametrize(
    ("worst", "words", "teach"),
    [
        (None, "All gestures are told apart.", None),
        ("mistaken", "“Two” is taken for “Three”, 2 of 8 times: teach “Two” again.", "a"),
        (
            "undecided",
            "“Two” and “Three” are close, 2 of 8 times too close to tell: teach “Two” again.",
            "a",
        ),
        ("near", "“Two” and “Three” are close: teach “Two” again.", "a"),
    ],
)
def test_the_worst_pair_is_named_with_advice(
    modules: Page, worst: str | None, words: str, teach: str | None
) -> None:
    pair = {"shown": "a", "other": "b", "level": worst, "times": 2, "asked": 8, "teach": "a"}
    given = {**MATRIX, "worst": pair if worst else None}
    said = run(modules, "ui/manager/matrix.js", "return m.verdict(a)", given)
    assert said == {"text": words, "teach": teach}


def test_the_matrix_is_a_table_that_can_be_read_without_colours(modules: Page) -> None:
    script = """
    const box = m.matrixTable(a);
    return [
        [...box.querySelectorAll("thead th")].map((one) => [one.scope, one.textContent]),
        [...box.querySelectorAll("tbody tr")].map((row) => [...row.children].map((one) => one.textContent)),
        [...box.querySelectorAll("tbody th")].every((one) => one.scope === "row"),
        [...box.querySelectorAll("tbody tr:first-child td")].map((one) => one.className),
        box.tabIndex, box.getAttribute("role"), Boolean(box.getAttribute("aria-label")),
    ];
    """  # noqa: E501
    head, rows, scoped, first, *box = run(modules, "ui/manager/matrix.js", script, MATRIX)
    names = ["Shown", "Two", "Three", "Fist", "nothing"]
    assert head == [["col", name] for name in names]
    assert rows[:2] == [["Two (8)", "5", "2", "0", "1"], ["Three (4)", "0", "4", "0", "0"]]
    assert scoped
    assert first == ["is-right shade-3", "is-wrong shade-1", "is-none", "is-rejected shade-1"]
    assert box == [0, "region", True]
    shades = run(modules, "ui/manager/matrix.js", "return a.map(([n, of]) => m.shade(n, of))", [
        [0, 8], [1, 100], [4, 8], [8, 8], [0, 0],
    ])  # fmt: skip
    assert shades == [0, 1, 2, 4, 0]


def test_a_plan_in_one_line(modules: Page) -> None:
    def plan(*fates: str) -> dict[str, Any]:
        return {"gestures": [{"fate": fate} for fate in fates]}

    script = "return a.map((one) => [m.summary(one), m.changesSomething(one)])"
    plans = [plan("new", "same", "new", "replaced"), plan("same", "skipped"), plan()]
    assert run(modules, "ui/manager/importing.js", script, plans) == [
        ["2 new, 1 replaced, 1 the same already", True],
        ["1 left as they are, 1 the same already", False],
        ["The file holds no gestures.", False],
    ]


FOLLOW = """
const asked = [];
const answers = [...a];
const api = {
    async job(id) { asked.push("ask"); return next(); },
    async cancelJob(id) { asked.push("cancel"); return next(); },
};
function next() {
    const answer = answers.shift();
    if (answer === null) throw Object.assign(new Error(), { status: 0 });
    return answer;
}
const told = [];
const cancelling = new AbortController();
let came;
try {
    came = await m.follow({ id: "j", state: "running", done: 0, total: 4 }, {
        api, signal: cancelling.signal, everyMs: 1,
        onProgress({ done }) { told.push(done); if (done === 2) cancelling.abort(); },
    });
} catch (error) {
    came = error.code;
}
return [came, told, asked];
"""
RUNNING = {"id": "j", "state": "running", "total": 4}
FAILED = {"state": "failed", "error": {"code": "invalid", "message": "no zip"}}


@pytest.mark.parametrize(
    ("answers", "came", "told", "asked"),
    [
        # An answer that is missed is asked for again.
        ([{**RUNNING, "done": 1}, None, {"state": "done", "result": 7}], 7, [0, 1, 1], ["ask"] * 3),
        ([FAILED], "invalid", [0], ["ask"]),
        (
            [{**RUNNING, "done": 2}, {**RUNNING, "done": 3}, {"state": "cancelled"}],
            "cancelled",
            [0, 2, 3],
            ["ask", "cancel", "ask"],
        ),
        # Too late to be cancelled: what was done is told.
        (
            [{**RUNNING, "done": 2}, {"state": "done", "result": 7}],
            7,
            [0, 2],
            ["ask", "cancel"],
        ),
    ],
)
def test_long_work_is_followed_to_its_end_and_cancelled(
    modules: Page, answers: list[Any], came: Any, told: list[int], asked: list[str]
) -> None:
    assert run(modules, "core/long-work.js", FOLLOW, answers) == [came, told, asked]


UNDO = """
const shown = [];
const undone = [];
const undo = new m.Undo({
    notices: { show: (text, options) => shown.push([text, options]) },
    undo: async (change) => {
        if (a.includes(change)) throw Object.assign(new Error("changed since"), { status: 409 });
        undone.push(change);
    },
});
const key = (target, more = {}) => target.dispatchEvent(
    new KeyboardEvent("keydown", { key: "z", ctrlKey: true, bubbles: true, ...more }),
);
const settled = () => new Promise((go) => setTimeout(go, 20));
"""


def test_undo_by_the_notice_and_by_the_keys_takes_back_the_newest(modules: Page) -> None:
    script = (
        UNDO
        + """
    undo.did("one", ["c1"]);
    undo.did("two", ["c2", undefined, "c3"]);
    undo.did("nothing", []);
    const offered = shown.map(([, { act, stayMs }]) => [Boolean(act), stayMs >= 10000]);
    document.body.replaceChildren(document.createElement("input"));
    const end = undo.listen(document);
    key(document.querySelector("input"));
    key(document.body, { shiftKey: true });
    await settled();
    const none = [...undone];
    key(document.body);
    await settled();
    const first = [...undone];
    shown[0][1].act.run();
    shown[0][1].act.run();
    await settled();
    end();
    key(document.body);
    undo.last();
    await settled();
    return [offered, none, first, undone, shown.slice(3).map(([text]) => text)];
    """
    )
    assert run(modules, "ui/undo.js", script, []) == [
        [[True, True], [True, True], [False, False]],
        [],
        ["c3", "c2"],
        ["c3", "c2", "c1"],
        ["Taken back: two", "Taken back: one", "There is nothing to take back."],
    ]


def test_what_cannot_be_taken_back_is_said_and_can_be_tried_again(modules: Page) -> None:
    script = (
        UNDO
        + """
    undo.did("one", ["c1", "c2"]);
    await undo.last();
    const first = [undone.slice(), shown.at(-1)[0], shown.at(-1)[1].kind];
    a.length = 0;
    await undo.last();
    return [...first, undone];
    """
    )
    assert run(modules, "ui/undo.js", script, ["c1"]) == [
        ["c2"], "changed since", "bad", ["c2", "c1"],
    ]  # fmt: skip


def test_a_notice_with_a_button_stays_while_somebody_is_at_it(modules: Page) -> None:
    script = """
    const host = document.createElement("div");
    document.body.replaceChildren(host);
    const notices = new m.Notices(host);
    let ran = 0;
    notices.show("gone", { stayMs: 10 });
    notices.show("kept", { stayMs: 10, act: { label: "Undo", id: "undo", run: () => (ran += 1) } });
    document.getElementById("undo").focus();
    await new Promise((go) => setTimeout(go, 200));
    const there = [...host.children].map((one) => one.dataset.name);
    document.getElementById("undo").click();
    return [there, ran, host.childElementCount];
    """
    assert run(modules, "ui/notices.js", script) == [["kept"], 1, 0]
