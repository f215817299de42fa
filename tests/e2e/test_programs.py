"""A program is written, checked, saved and taken back on the page, with a real robot behind it."""

import re

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, wait_for

pytestmark = pytest.mark.e2e

"""ms; these machines are slow now and then, and no test here is about speed."""


def edit(page: Page, name: str) -> None:
    page.get_by_role("button", name=f"Change “{name}”").click()


def step(page: Page, number: int) -> Locator:
    return page.locator("#sheet-teach .step-list > li").nth(number - 1)


def check(page: Page) -> Locator:
    """Press the button until somebody answers; gives the result."""
    result = page.locator("#check-result")
    for _ in range(10):
        page.click("#action-check")
        expect(page.locator("#action-check")).to_be_enabled()
        if "answer" not in result.inner_text():
            return result
    raise AssertionError(f"never checked: {result.inner_text()}")


def test_a_program_is_checked_saved_and_taken_back(server: Server, open_page: OpenPage) -> None:
    page = open_page(server.link, height=1100, allow_errors=True)  # of a 409
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    wait_for(page, "window.farhand.state.description !== null")
    joints = page.evaluate("window.farhand.robot.joints")

    # Two steps: up by 5 cm, and a line that leads out of reach.
    edit(page, "home")
    expect(page.locator("#action-former")).to_have_count(0)
    form = page.locator("#sheet-teach .action-form").first
    form.locator("select[name=kind]").first.select_option("sequence")
    first, second = step(page, 1), step(page, 2)
    for one in (first, second):
        one.locator("select[name=kind]").select_option("move_linear")
    first.locator("[name=offset-x]").fill("0")
    first.locator("[name=offset-z]").fill("5")
    second.locator("[name=offset-x]").fill("100")
    result = check(page)
    expect(result).to_contain_text("It meets a limit:")
    expect(result).to_contain_text("Step 2: Only ")
    expect(result).to_contain_text("of 100.0 cm can be reached in a straight line")
    expect(second).to_have_class("has-problem")
    expect(first).not_to_have_class("has-problem")

    # The way is seen in the 3D view, which is hidden where WebGL is slow.
    root = page.locator("html")
    page.click("#check-3d")
    expect(root).to_have_class(re.compile(r"\bhas-path\b"))
    expect(page.locator("#view-3d iframe")).to_be_visible()
    expect(result).to_contain_text("The 3D view shows the way")

    # Mended: what was found is forgotten, and checked anew.
    second.locator("[name=offset-x]").fill("-5")
    expect(result).to_be_empty()
    expect(root).not_to_have_class(re.compile(r"\bhas-path\b"))
    expect(page.locator("#view-3d iframe")).to_have_count(0)
    expect(second).not_to_have_class("has-problem")
    page.locator("#sheet-teach select[name=from]").select_option("left")
    check(page)
    expect(result).to_contain_text("It takes")
    expect(result).to_have_class("check-result is-good")
    page.click("#teach-save")
    expect(page.locator("#sheet-teach")).to_have_count(0)
    gesture = "farhand.state.gestures.find((g) => g.name === 'home')"
    wait_for(page, f"window.{gesture}.version === 2")
    assert page.evaluate(f"window.{gesture}.action.steps.map((s) => s.offset)") == [
        [0, 0, 0.05],
        [-0.05, 0, 0],
    ]
    assert page.evaluate("window.farhand.robot.joints") == pytest.approx(joints, abs=1e-3)

    # Somebody else changes it while the sheet is open: saving over it is refused.
    edit(page, "home")
    with server.api() as api:
        found = [each for each in api.get("/api/gestures").json() if each["name"] == "home"]
        path = f"/api/gestures/{found[0]['id']}"
        assert api.patch(path, json={"action": {"type": "stop"}}).status_code == 200
    page.locator("#sheet-teach .action-form select[name=kind]").first.select_option("pose")
    page.click("#teach-save")
    expect(page.locator("#teach-problem")).to_contain_text("was changed meanwhile")
    page.locator("#sheet-teach [data-part=close]").click()

    # What it did at first is taken back.
    wait_for(page, f"window.{gesture}.version === 3")
    edit(page, "home")
    page.click("#action-former")
    rows = page.locator(".former-list li")
    expect(rows).to_have_count(2)
    expect(rows.last).to_contain_text("go home")
    rows.last.get_by_role("button").click()
    wait_for(page, f"window.{gesture}.version === 4")
    assert page.evaluate(f"window.{gesture}.action.type") == "home"
