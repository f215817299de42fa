"""What happened is seen on the page, and is still there after the server started again."""

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.gestures.synthetic import Step, SyntheticOperator, write_mjpeg
from tests.e2e.conftest import OpenPage
from tests.e2e.running import start_server, stop_server, wait_for
from tests.e2e.test_drive import start_driving

pytestmark = pytest.mark.e2e

WIDE = "(document.querySelector('{}')?.naturalWidth ?? 0) > 0"


def row(page: Page, kind: str) -> str:
    """The newest row of a kind, with its pictures loaded."""
    first = f"#timeline-days .event[data-kind={kind}]"
    wait_for(page, WIDE.format(f"{first} .event-robot"))
    return first


def become(page: Page, gallery: str) -> None:
    """Be the person of a gallery, as a browser remembers who has chosen before."""
    wait_for(page, "Boolean(window.farhand?.hello)")
    page.evaluate("(id) => localStorage.setItem('farhand-gallery', id)", gallery)
    page.reload()
    wait_for(page, f"window.farhand?.state.gallery === '{gallery}' && window.farhand.hello")


def test_what_was_driven_and_stopped_is_on_the_timeline_also_after_a_restart(
    tmp_path: Path, open_page: OpenPage
) -> None:
    video = tmp_path / "webcam.mjpeg"
    write_mjpeg(SyntheticOperator((Step(None, 1.0), Step("up", 2.0))).frames(), video)
    server = start_server(tmp_path)
    try:
        # Whose hand it is: their choices go to the server.
        with server.api() as api:
            ann = api.post("/api/galleries", json={"name": "Ann"}).json()["id"]
        page = open_page(server.link, webcam=video)
        become(page, ann)
        start_driving(page)
        page.keyboard.press("f")
        wait_for(page, "window.farhand.robot.mode === 'moving'")

        # It is open while it happens, and grows; the stop keys go on working.
        page.click("#timeline-open")
        shown = row(page, "gesture")
        expect(page.locator(shown).first).to_contain_text("“up”")
        wait_for(page, WIDE.format(f"{shown} .event-hand"))
        page.keyboard.press("Escape")
        wait_for(page, "window.farhand.robot.mode === 'stopped'")
        page.click("#timeline-open")
        page.select_option("#timeline-filter", "trouble")
        stop = page.locator(row(page, "stop")).first
        expect(stop).to_contain_text("Stop (S1)")
        expect(stop).to_contain_text("by the STOP button · you")
        assert page.locator(".event[data-kind=gesture]").count() == 0
        with page.expect_download() as saving:
            page.click("#timeline-save")
        assert '"kind":"stop"' in saving.value.path().read_text()
        page.close()  # or it would complain that its server is gone
    finally:
        stop_server(server)

    server = start_server(tmp_path)
    try:
        # Another browser, which remembers nothing, on a phone.
        page = open_page(server.link, width=360, height=740)
        wait_for(page, "window.farhand?.robot?.mode === 'stopped'")
        page.click("#timeline-open")
        expect(page.locator(row(page, "stop")).first).to_contain_text("by the STOP button")
        row(page, "gesture")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        page.keyboard.press("Escape")
        assert page.evaluate("window.farhand.state.fine") is False
        become(page, ann)
        wait_for(page, "window.farhand.state.fine === true")
        page.close()
    finally:
        stop_server(server)
