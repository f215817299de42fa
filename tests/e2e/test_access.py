"""Without eyes: axe-core finds nothing in any state of the page."""

import os
from collections.abc import Iterator
from typing import Any

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page

from tests.e2e.conftest import ARTIFACTS, OpenPage
from tests.e2e.running import Server, start_server, stop_server
from tests.e2e.walk import EVERY_LOOK, TWO_LOOKS, opened, walk

pytestmark = pytest.mark.e2e

THOROUGH = bool(os.environ.get("FARHAND_EVERY_LOOK"))
"""Both sizes in both schemes, with a picture of each; twice as slow."""
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
AXE = """
async (tags) => {
    await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    // What moves is judged where it comes to rest; what is taken away meanwhile rejects.
    await Promise.all(document.getAnimations().map((each) => each.effect.getTiming().iterations === Infinity || each.finished.catch(() => {})));
    // The 3D view is viser's own page.
    const found = await axe.run(document, { runOnly: tags, resultTypes: ["violations"], iframes: false });
    return found.violations.flatMap(({ id, nodes }) =>
        nodes.map(({ target, failureSummary }) => `${id}: ${target.join(" ")}: ${failureSummary}`));
}
"""  # noqa: E501
ENGLISH_LEFT = """
async () => {
    const leaves = (level) => Object.values(level).flatMap((value) =>
        typeof value === "object" ? leaves(value) : typeof value === "string" ? [value] : []);
    const words = async (name) => new Set(leaves((await import(`/static/texts/${name}.js`)).texts));
    const [english, german] = [await words("en"), await words("de")];
    const seen = [];
    const kinds = NodeFilter.SHOW_ELEMENT | NodeFilter.SHOW_TEXT;
    const all = document.createTreeWalker(document.body, kinds);
    for (let node = all.nextNode(); node; node = all.nextNode()) {
        if (node.nodeType === Node.TEXT_NODE) {
            const { parentElement: around } = node;
            if (!around.closest("[lang], noscript")) seen.push(node.textContent.trim());
        } else for (const name of ["aria-label", "title", "placeholder", "alt"]) {
            if (node.hasAttribute(name)) seen.push(node.getAttribute(name));
        }
    }
    // Names of gestures and poses are people's own.
    const { gestures, description } = window.farhand.state;
    const names = new Set([...gestures.map(({ name }) => name), ...Object.keys(description.poses)]);
    return seen.filter((text) => english.has(text) && !german.has(text) && !names.has(text));
}
"""


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    running = start_server(tmp_path_factory.mktemp("access"))
    yield running
    stop_server(running)


def findings(page: Page, where: str) -> dict[str, list[Any]]:
    """What axe-core finds, by the look of the page."""
    found = {}
    for number, give in enumerate(EVERY_LOOK if THOROUGH else TWO_LOOKS):
        give(page)
        found[f"{where}-{number}"] = page.evaluate(AXE, TAGS)
        if THOROUGH:
            ARTIFACTS.mkdir(exist_ok=True)
            page.screenshot(path=ARTIFACTS / f"access-{where}-{number}.png")
    return {name: each for name, each in found.items() if each}


def test_axe_finds_nothing_and_no_english_is_left_in_any_state_of_the_german_page(
    running: Server, open_page: OpenPage
) -> None:
    # The server is cut off at the end, and the browser says so.
    page = open_page("about:blank", allow_errors=True)
    wire = opened(page, running, "de")
    page.evaluate(AXE_SCRIPT + ";0")
    assert page.evaluate("document.documentElement.lang") == "de"
    wrong: dict[str, Any] = {}
    for where in walk(page, wire):
        wrong |= findings(page, where)
        if english := page.evaluate(ENGLISH_LEFT):
            wrong[f"{where}: English"] = english
    assert not wrong, "\n".join(f"{name}: {each}" for name, all_ in wrong.items() for each in all_)
