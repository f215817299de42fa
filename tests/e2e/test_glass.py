"""The recognition can be watched thinking, and one frame's time is split into its parts."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, take_and_arm, wait_for

pytestmark = pytest.mark.e2e

STAGES = ["mask", "motion", "wrist", "region", "template", "projection"]
EVERY_STAGE = (
    "[...document.querySelectorAll('#glass-body [data-stage]')]"
    ".every((step) => step.dataset.reached === 'yes')"
)
DRAWN = """
() => [...document.querySelectorAll("#glass-body canvas")].map((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return canvas.ariaLabel.length > 20 && data.some((value, at) => at % 4 !== 3 && value > 60);
}).every((isDrawn, at) => isDrawn || at === 1)
"""
"""All but the second, what moved: that is black while nothing does."""
PARTS = """
() => {
    const ms = (text) => (text.startsWith("under") ? 0 : Number(text.replace(" ms", "")));
    const all = [...document.querySelectorAll("#latency-list dd")].map((dd) => dd.textContent);
    const total = document.getElementById("latency-total").textContent;
    return { parts: all.slice(0, 6).map(ms), sum: ms(all[6]), total: ms(total) };
}
"""


def demonstrate(page: Page) -> None:
    """Start the drawn hand."""
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    page.click("#choose-synthetic")
    wait_for(page, "window.farhand.state.detail !== null")


def test_the_glass_box_shows_every_step_and_the_bar_where_the_time_goes(
    server: Server, open_page: OpenPage
) -> None:
    page = open_page(server.link)
    demonstrate(page)
    # Folded it is one sentence, and the server is asked for no more than before.
    body, sentence = page.locator("#glass-body"), page.locator("#glass-sentence")
    expect(body).to_be_hidden()
    expect(page.locator("#glass-toggle")).to_have_attribute("aria-expanded", "false")
    expect(sentence).to_have_text(re.compile(r"^It is “\w+”"))
    assert page.evaluate("window.farhand.state.detail.glass === undefined")

    page.click("#glass-toggle")
    expect(body).to_be_visible()
    wait_for(page, f"document.querySelectorAll('#glass-body [data-stage]').length && {EVERY_STAGE}")
    stages = page.locator("#glass-body [data-stage]").evaluate_all(
        "all => all.map((step) => step.dataset.stage)"
    )
    assert stages == STAGES
    wait_for(page, f"{EVERY_STAGE} && ({DRAWN})()")
    loaded = "all => all.filter((picture) => picture.naturalWidth === 60 && picture.alt).length"
    assert page.locator("#glass-body .near-list img").count() == 5
    wait_for(
        page, f"({loaded})([...document.querySelectorAll('#glass-body .near-list img')]) === 5"
    )
    expect(page.locator("#glass-body .room")).to_contain_text("passes")
    expect(page.locator("#seen-mask")).to_contain_text("because the background")

    # The hand goes: so does what came of it, and the sentence says why.
    expect(sentence).to_have_text(re.compile("No hand in the box|hold (it )?still"))
    wait_for(page, "document.querySelector('[data-stage=template]').dataset.reached === 'no'")

    # It stays open for the next time, and folded once it was folded.
    page.reload()
    demonstrate(page)
    expect(body).to_be_visible()
    page.click("#glass-toggle")
    expect(body).to_be_hidden()
    wait_for(page, "window.farhand.state.detail.glass === undefined")

    # From the camera to the motion and back: the parts are named, and add up.
    take_and_arm(page)
    wait_for(page, "window.farhand.latency.whole", 120)
    expect(page.locator("#latency-age")).to_have_text(re.compile(r"^picture \d+ ms old$"))
    page.focus("#latency-bar")
    expect(page.locator("#latency-list")).to_contain_text("Way to the robot, until it moves")
    wait_for(page, "document.querySelectorAll('.latency-track [hidden]').length === 0")
    found = page.evaluate(PARTS)
    assert len(found["parts"]) == 6
    assert sum(found["parts"]) == found["sum"] == found["total"] > 0
