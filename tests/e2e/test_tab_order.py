"""Tab goes through everything that can be used, in the order in which it stands, and is seen."""

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, wait_for

pytestmark = pytest.mark.e2e

MARK = """() => {
    // Everything that the page offers now, numbered.
    const fields = "a[href], button, input, select, textarea, summary, [tabindex]";
    const usable = [...document.querySelectorAll(fields)].filter((each) =>
        each.tabIndex >= 0 && !each.disabled && !each.closest("[inert]")
            && each.checkVisibility({ checkVisibilityCSS: true }));
    usable.forEach((each, at) => { each.dataset.tabAt = at; });
    return usable.map((each) => each.id || each.ariaLabel || each.textContent.trim());
}"""
WHERE = """() => {
    const at = document.activeElement;
    if (!at || at === document.body) return null;
    const { outlineStyle, outlineWidth, boxShadow } = getComputedStyle(at);
    const { width, height, top, bottom } = at.getBoundingClientRect();
    const outlined = outlineStyle !== "none" && parseFloat(outlineWidth) >= 2;
    const ringed = outlined || boxShadow !== "none";
    const inView = bottom > 0 && top < innerHeight && width > 0 && height > 0;
    return { at: Number(at.dataset.tabAt ?? -1), name: at.id || at.className, ringed, inView };
}"""


@pytest.fixture(scope="module")
def server(one_server: Server) -> Server:
    return one_server


def all_marked(page: Page) -> list[str]:
    """Number what can be used, once nothing is about to change any more.

    The page shows its state a little later than it has it.
    """
    names: list[str] = page.evaluate(MARK)
    for _ in range(100):
        page.wait_for_timeout(300)
        before, names = names, page.evaluate(MARK)
        if names == before:
            return names
    raise AssertionError("the page does not settle")


def once_round(page: Page, most: int, key: str = "Tab") -> list[dict[str, Any]]:
    """Where each press of Tab leads, until it comes back; the page's first first."""
    found: list[dict[str, Any]] = []
    for _ in range(most):
        page.keyboard.press(key)
        where = page.evaluate(WHERE)
        if where is None:  # between the end and the beginning
            continue
        if found and where["at"] == found[0]["at"]:
            first = min(range(len(found)), key=lambda at: found[at]["at"])
            return found[first:] + found[:first]
        found.append(where)
    raise AssertionError("Tab does not come back")


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (360, 740)])
@pytest.mark.parametrize("source", ["none", "keys"])
def test_tab_goes_through_everything_in_its_order(
    server: Server, open_page: OpenPage, width: int, height: int, source: str
) -> None:
    page = open_page("about:blank", width=width, height=height)
    page.add_init_script("localStorage.setItem('farhand-hide-3d', 'yes')")
    page.goto(server.link)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    wait_for(page, "window.farhand.state.gesturesState === 'ready'")
    wait_for(page, "document.querySelectorAll('#gestures li.gesture').length === 10")
    if source == "keys":
        page.click("#choose-keys")
        page.wait_for_selector("#jog [data-move=forward]")
        page.evaluate("document.activeElement.blur()")
    names = all_marked(page)
    assert len(names) > 20
    forth = once_round(page, 3 * len(names))
    numbered = [each["at"] for each in forth]
    assert [names[at] for at in sorted(set(range(len(names))) - set(numbered))] == []
    assert numbered == sorted(numbered)
    assert [each["name"] for each in forth if not each["ringed"]] == []
    assert [each["name"] for each in forth if not each["inView"]] == []
    back = [each["at"] for each in once_round(page, 3 * len(names), "Shift+Tab")]
    assert back == [*numbered[:1], *numbered[:0:-1]]


def test_focus_stays_when_the_gestures_are_told_anew(server: Server, open_page: OpenPage) -> None:
    page = open_page(server.link)
    wait_for(page, "window.farhand?.state.gesturesState === 'ready'")
    button = page.get_by_role("button", name="Change “up”")
    button.focus()
    with server.api() as api:
        (up,) = [each for each in api.get("/api/gestures").json() if each["name"] == "up"]
        retired = api.patch(f"/api/gestures/{up['id']}", json={"active": False})
        retired.raise_for_status()
    wait_for(
        page, f"document.querySelector('[data-id=\"{up['id']}\"]').innerText.includes('retired')"
    )
    assert page.evaluate("document.activeElement.ariaLabel") == "Change “up”"
