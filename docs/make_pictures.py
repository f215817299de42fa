"""Take the pictures of the README: a real server, a real browser, the drawn hand as webcam.

Start it with ``python -m docs.make_pictures``.
"""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page

from app.gestures.hand import POSES, HandView, render_hand
from app.gestures.synthetic import Step
from benchmarks.driving import browser, webcam
from tests.e2e.running import start_server, stop_server, wait_for

PICTURES = Path(__file__).parent / "pictures"
PAUSE = "window.paint = requestAnimationFrame; window.requestAnimationFrame = (f) => (window.f = f)"
ONE_FRAME = "paint(window.f)"


def draw_gestures() -> None:
    """The ten starter gestures side by side, with their names."""
    tiles = []
    for name, pose in POSES.items():
        tile = render_hand(pose, (200, 240), HandView(150, (88.0, 128.0)))
        cv2.putText(tile, name, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.65, (60, 40, 20), 2)
        tiles.append(tile)
    half = len(tiles) // 2
    rows = [np.hstack(tiles[:half]), np.hstack(tiles[half:])]
    cv2.imwrite(str(PICTURES / "gestures.png"), np.vstack(rows))


def take(page: Page, name: str) -> None:
    """Save what the page shows now."""
    page.screenshot(path=PICTURES / f"{name}.png")


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    draw_gestures()
    with tempfile.TemporaryDirectory() as folder:
        video = webcam((Step(None, 0.6), Step("left", 2.5)), Path(folder) / "left.mjpeg")
        server = start_server(Path(folder))
        try:
            with browser(server, video, view_3d=True) as page:
                page.set_viewport_size({"width": 1360, "height": 850})
                page.frame_locator("#view-3d iframe").locator("canvas").first.wait_for()
                page.wait_for_timeout(15_000)  # the meshes arrive
                # Software WebGL leaves too few frames to drive by: it pauses until the arm moves.
                view = page.query_selector("#view-3d iframe").content_frame()
                view.evaluate(PAUSE)
                wait_for(page, "window.farhand.robot.mode === 'moving'")
                page.wait_for_timeout(500)
                view.evaluate(ONE_FRAME)
                page.wait_for_timeout(250)
                take(page, "drive")
                page.click("#hide-3d")
                page.click("#teach-open")
                page.fill("#teach-name", "wave")
                page.click("#capture-one")
                page.wait_for_selector(".stills li", timeout=20_000)
                take(page, "teach")
            with browser(server, video) as page:
                page.set_viewport_size({"width": 360, "height": 740})
                wait_for(page, "window.farhand.robot.mode === 'moving'")
                page.wait_for_timeout(400)
                take(page, "phone")
        finally:
            stop_server(server)


if __name__ == "__main__":
    main()
