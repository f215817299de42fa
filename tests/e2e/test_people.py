"""Two people, two browsers, one robot."""

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import MINE, Server, press_until, wait_for

pytestmark = pytest.mark.e2e


def take(page: Page) -> None:
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    press_until(page, "#btn-control", MINE)


def test_one_asks_and_the_other_drives_on_and_then_hands_over(
    server: Server, open_page: OpenPage
) -> None:
    first, second = open_page(server.link), open_page(server.link)
    take(first)
    wait_for(second, "window.farhand?.robot?.controller")
    expect(first.locator("#driver")).to_contain_text("You drive · 1 other here")
    name = second.evaluate("window.farhand.hello.session")

    for answer in ("keep", "hand-over"):
        press_until(second, "#btn-control", "document.querySelector('#sheet-take-over')")
        second.click("#sheet-take-over [data-part=ask]")
        asking = first.locator("#asking .notice")
        expect(asking).to_contain_text(f"{name} asks for control.")
        first.click(f"#asking [data-part={answer}]")
        expect(asking).to_be_hidden()
        if answer == "keep":
            refusal = second.locator("#notices .notice", has_text="goes on driving")
            expect(refusal).to_be_visible()
            wait_for(first, MINE)

    wait_for(second, MINE)
    expect(second.locator("#notices")).to_contain_text("Control is yours.")
    wait_for(first, "!(" + MINE + ")")
    assert first.evaluate("!window.farhand.robot.armed")
    # It was given away, not lost.
    assert first.locator("#notices .notice", has_text="You no longer drive").count() == 0
