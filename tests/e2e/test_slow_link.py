"""Driving over 150 ms and 2 Mbit/s, and what is left after the link was cut."""

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, wait_for
from tests.e2e.test_drive import height, showing_up, start_driving
from tests.slow_link import SlowLink

__all__ = ["showing_up"]

pytestmark = pytest.mark.e2e


@pytest.fixture
def link(server: Server) -> Iterator[SlowLink]:
    port = urlsplit(server.url).port
    assert port is not None
    with SlowLink(port, delay_s=0.075, rate=2e6 / 8) as link:
        yield link


def test_driving_over_a_slow_link_and_back_by_itself_after_a_cut(
    server: Server, link: SlowLink, open_page: OpenPage, showing_up: Path
) -> None:
    url = server.link.replace(server.url, f"http://127.0.0.1:{link.port}")
    page = open_page(url, webcam=showing_up, allow_errors=True)
    start_driving(page)
    low = height(page)
    wait_for(page, f"window.farhand.robot.tool.position[2] > {low + 0.02}")
    wait_for(page, "window.farhand.pictures.wrist > 5 && window.farhand.pictures.scene > 5")
    # The age counts from when the robot stood so, not from when the picture came.
    wait_for(page, "Object.values(window.farhand.shown).every((p) => p.shownAt - p.takenAt > 75)")

    session = page.evaluate("window.farhand.hello.session")
    page.evaluate("window.sameDocument = true")
    pictures = page.evaluate("window.farhand.pictures")
    wait_for(page, "window.farhand.robot.mode === 'moving'")
    link.hold()
    # Nobody can be heard: the arm comes to rest, whatever the hand shows.
    with server.api() as api:
        deadline_looks = 200
        while api.get("/api/robots/puma").json()["mode"] == "moving":
            deadline_looks -= 1
            assert deadline_looks
            page.wait_for_timeout(50)
    wait_for(page, "window.farhand.state.connection.state !== 'open'")
    page.wait_for_timeout(500)
    link.forward()
    wait_for(page, "window.farhand.state.connection.state === 'open'")
    wait_for(page, f"window.farhand.hello.session !== '{session}' && window.farhand.robot !== null")
    wait_for(page, "!window.farhand.robot.armed && window.farhand.robot.controller === null")
    for name, count in pictures.items():
        wait_for(page, f"window.farhand.pictures.{name} > {count + 10}")
    # The hand is still shown, and moves nothing.
    count = page.evaluate("window.farhand.counts.gesture")
    stood = page.evaluate("window.farhand.robot.joints")
    wait_for(page, f"window.farhand.counts.gesture > {count + 10}")
    assert page.evaluate("window.farhand.robot.joints") == pytest.approx(stood, abs=2e-3)
    assert page.evaluate("window.sameDocument"), "the page was loaded anew"
