"""The way of a dry run on the page, without a server: the 3D view is borrowed and given back."""

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.e2e.running import run

VIEW = """
const calls = [];
const view = {
    id: "view-1",
    canDraw: a.canDraw,
    isHidden: a.hidden,
    borrow: () => calls.push("borrow"),
    giveBack: () => calls.push("give back"),
};
const path = new m.PathView(view, (id) => calls.push(`forget ${id}`));
const report = { path: { times: a.times } };
const box = document.createElement("div");
const words = () => box.textContent;
"""
ASK = "const wanted = path.wanted(); box.append(...path.told(report, a.drives));"
USUAL = {"canDraw": True, "hidden": False, "times": [0, 1], "drives": False}


def path_view(modules: Page, script: str, **changes: Any) -> Any:
    return run(modules, "ui/path-view.js", VIEW + ASK + script, USUAL | changes)


def test_an_open_3d_view_shows_the_way_at_once_until_it_holds_no_more(modules: Page) -> None:
    wanted, words, calls, after = path_view(
        modules,
        "const c = [...calls]; path.close(); path.close(); return [wanted, words(), c, calls]",
    )
    assert wanted["view"] == "view-1"
    assert wanted["still"] in (True, False)
    assert "The 3D view shows the way: the line is the tool" in words
    assert calls == ["borrow"]
    # The server is told once, the view given back for sure.
    assert after == ["borrow", "give back", "forget view-1", "give back"]


def test_a_hidden_3d_view_is_opened_only_when_asked(modules: Page) -> None:
    before, words, calls = path_view(
        modules,
        "const c = [...calls]; const b = box.querySelector('button'); b.click();"
        "return [c, [b.textContent, words()], calls]",
        hidden=True,
    )
    assert before == []
    assert words[0] == "See the way in 3D"
    assert "the pale robot goes along it" in words[1]
    assert calls == ["borrow"]


def test_of_a_robot_that_drives_the_way_is_on_the_floor(modules: Page) -> None:
    assert "on the floor" in path_view(modules, "return words()", drives=True)


@pytest.mark.parametrize("changes", [{"canDraw": False}, {"times": []}])
def test_without_a_way_or_without_webgl_nothing_is_said(
    modules: Page, changes: dict[str, Any]
) -> None:
    wanted, words, calls = path_view(modules, "return [wanted, words(), calls]", **changes)
    assert words == ""
    assert calls == []
    assert (wanted is None) == ("canDraw" in changes)


def test_a_robot_that_drives_is_checked_from_where_it_is(modules: Page) -> None:
    script = (
        "const form = { element: document.createElement('div') };"
        "const of = (description) => [...m.programCheck({ form, description })"
        ".querySelectorAll('option')].map((one) => one.value);"
        "return [of({ poses: { home: [], left: [] } }), of({ drives: true, poses: { start: [] } })]"
    )
    arm, base = run(modules, "ui/program-check.js", script)
    assert arm == ["current", "home", "left"]
    assert base == ["current"]
