"""The gesture manager with a real server: pictures, undo, mix-ups, a gallery as a file."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from app.gateway.gallery import DATABASE_FILE
from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, start_server, stop_server, wait_for
from tests.small_gallery import fill_small

pytestmark = pytest.mark.e2e

UP = "window.farhand.state.gestures.find((one) => one.name === 'up')"


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """A server with two pictures of each gesture: what is changed is learned anew at once."""
    (tmp_path / "data").mkdir()
    fill_small(tmp_path / "data" / DATABASE_FILE)
    running = start_server(tmp_path)
    yield running
    stop_server(running)


def row(page: Page, name: str) -> Locator:
    named = page.locator(".managed-name").get_by_text(name, exact=True)
    return page.locator("#managed > li").filter(has=named)


def test_a_gallery_is_looked_after(server: Server, open_page: OpenPage, tmp_path: Path) -> None:
    page = open_page(server.link, width=360, height=740)
    wait_for(page, "window.farhand?.state.gesturesState === 'ready'")
    before = page.evaluate(UP)

    # A picture is deleted, and the notice takes that back; by keyboard alone.
    page.locator("#manage-open").focus()
    page.keyboard.press("Enter")
    row(page, "up").get_by_role("button", name="pictures of").press("Enter")
    row(page, "up").locator(".sample").nth(1).press("Enter")
    row(page, "up").get_by_role("button", name="Delete picture 2").press("Enter")
    # The page hears of it after the answer; else it would be taken for taken back already.
    wait_for(page, f"{UP}.samples === {before['samples'] - 1}")
    page.locator("#notices #undo").press("Enter")
    wait_for(page, f"{UP}.samples === {before['samples']}")
    assert page.evaluate(UP)["sample_ids"] == before["sample_ids"]

    # Retired, and Ctrl+Z.
    row(page, "up").get_by_role("button", name="Retire").click()
    wait_for(page, f"{UP}.active === false")
    expect(row(page, "up")).to_have_class("is-retired")
    # The button is there only once the server has answered.
    expect(page.locator("#notices #undo")).to_be_visible()
    page.keyboard.press("Control+z")
    wait_for(page, f"{UP}.active === true")

    # The matrix: a row for each gesture, and one sentence.
    page.click("#manager-matrix")
    expect(page.locator(".matrix tbody tr")).to_have_count(10)
    expect(page.locator(".matrix-verdict")).not_to_be_empty()
    scroll = "(box) => box.scrollWidth > box.clientWidth && document.body.scrollWidth <= innerWidth"
    assert page.locator(".matrix-scroll").evaluate(scroll)

    # Out as a file.
    with page.expect_download() as saving:
        page.click("#manager-export")
    file = tmp_path / "gallery.zip"
    saving.value.save_as(file)

    # In again: what would happen is shown first; then it does, and is taken back.
    with server.api() as api:
        assert api.patch(f"/api/gestures/{before['id']}", json={"name": "higher"}).is_success
    wait_for(page, f"{UP} === undefined")
    page.click("#manager-import")
    page.set_input_files("#import-file", file)
    verdict = page.locator("#manager-panel .matrix-verdict")
    expect(verdict).to_have_text("1 new, 9 the same already")
    page.click("#import-go")
    wait_for(page, f"{UP} !== undefined")
    assert page.evaluate("window.farhand.state.gestures.length") == 11
    page.click("#notices #undo")
    wait_for(page, f"{UP} === undefined")

    # A file that is none changes nothing and says why.
    bad = tmp_path / "bad.zip"
    bad.write_bytes(b"no zip")
    page.set_input_files("#import-file", bad)
    problem = page.locator("#manager-panel .problem-line")
    expect(problem).to_contain_text("neither a readable folder nor a readable zip")
    assert page.evaluate("window.farhand.state.gestures.length") == 10
