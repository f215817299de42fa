"""The 3D view in a real browser: all that its page sends may be sent."""

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import cv2
import numpy as np
import pytest
from playwright.sync_api import Page

from tests.e2e.conftest import OpenPage
from tests.e2e.running import run
from tests.gateway.running import TOKEN, Running, StandIn, running, settings_for, wait_for

pytestmark = pytest.mark.e2e

KEYS = ("w", "a", "s", "d", "ArrowLeft", "Enter", "Escape", "/", "Control+k", "Control+Shift+k")


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Running]:
    folder = Path(tempfile.mkdtemp(prefix="fh-"))
    with (
        StandIn(folder) as node,
        running(settings_for(tmp_path, node.endpoint, viser=True)) as here,
    ):
        yield here
    shutil.rmtree(folder, ignore_errors=True)


def dark(page: Page) -> float:
    """Share of the middle's pixels that are dark: the arm's column is, ground and sky are not."""
    data = page.screenshot(clip={"x": 400, "y": 300, "width": 640, "height": 400})
    grey = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    return float(np.mean(grey < 110))


def test_the_scene_shows_and_nobody_who_looks_round_is_turned_away(
    server: Running, open_page: OpenPage
) -> None:
    scene = server.hub.viser
    assert scene is not None
    wait_for(lambda: scene.shown_tick, "the scene to be built", 60)
    assert scene.server is not None
    page = open_page(f"{server.url}/?token={TOKEN}", camera_allowed=False)
    ticket = run(page, "core/sign-in.js", "return m.ticket();")
    address = f"{server.url.replace('http', 'ws', 1)}/viser?view=0123456789abcdef"
    address = quote(f"{address}&ticket={ticket}", safe="")
    page.goto(f"{server.url}/viser/?fixedDpr=1&websocket={address}")
    page.locator("canvas").first.wait_for()
    (client,) = wait_for(lambda: list(scene.server.get_clients().values()), "the camera", 60)
    wait_for(lambda: dark(page) > 0.02, "the arm to be drawn", 60)

    before = client.camera.position
    page.mouse.move(600, 400)
    page.mouse.down()
    for step in range(10):
        page.mouse.move(600 + 20 * step, 400)
    page.mouse.up()
    wait_for(lambda: not np.allclose(client.camera.position, before, atol=0.05), "the camera to go")
    page.mouse.wheel(0, 200)
    page.mouse.dblclick(600, 400)
    page.mouse.click(600, 400, button="right")
    for key in KEYS:
        page.keyboard.press(key)
    page.set_viewport_size({"width": 800, "height": 600})
    wait_for(lambda: client.camera.image_width <= 800, "its new size to be told")
    assert list(scene.server.get_clients().values()) == [client]
    assert "viewer_message" not in server.http.get("/metrics").text
