"""Take the pictures of README.md and docs/tour.md: a real server, a real browser, drawn hands.

Start it with ``python -m docs.make_pictures``, or give the names of some: ``... phone people``.
Needs Chromium, which draws 3D in software here. A few minutes.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Frame, Page

from app.gestures.hand import POSES, HandView, render_hand
from app.gestures.synthetic import Step
from benchmarks.driving import browser, webcam
from tests.e2e.person import person_script
from tests.e2e.running import Server, start_server, stop_server, take_and_arm, wait_for

PICTURES = Path(__file__).parent / "pictures"
QUALITY = 78
DESK, PHONE = (1280, 800), (360, 740)
PATIENCE_MS = 180_000
PAUSE = "window.paint = requestAnimationFrame; window.requestAnimationFrame = (f) => (window.f = f)"
ONE_FRAME = "paint(window.f)"
LARGE_3D = "document.getElementById('stage').dataset.large = '3d'"
MOVING = "window.farhand.robot.mode === 'moving'"


def draw_gestures() -> None:
    """The ten starter gestures side by side, with their names."""
    tiles = []
    for name, pose in POSES.items():
        tile = render_hand(pose, (200, 240), HandView(150, (88.0, 128.0)))
        cv2.putText(tile, name, (10, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.65, (60, 40, 20), 2)
        tiles.append(tile)
    half = len(tiles) // 2
    rows = [np.hstack(tiles[:half]), np.hstack(tiles[half:])]
    save(np.vstack(rows), "gestures")


def save(picture: np.ndarray, name: str) -> None:
    """Write a picture (BGR) as WebP."""
    cv2.imwrite(str(PICTURES / f"{name}.webp"), picture, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])


def take(page: Page, name: str) -> None:
    """Save what the page shows now."""
    shot = np.frombuffer(page.screenshot(timeout=PATIENCE_MS), np.uint8)
    picture = cv2.imdecode(shot, cv2.IMREAD_COLOR)
    assert picture is not None
    save(picture, name)


@contextmanager
def driving(
    server: Server, video: Path, size: tuple[int, int] = DESK, *, view_3d: bool = False
) -> Iterator[Page]:
    """A page that drives, of a size in pixels."""
    with browser(server, video) as page:
        page.set_default_timeout(PATIENCE_MS)
        page.set_viewport_size({"width": size[0], "height": size[1]})
        if view_3d:
            page.click("#show-3d")
        yield page


def pause_3d(page: Page) -> Frame:
    """Wait until the 3D view is there, and stop its drawing.

    Software WebGL leaves too few of the webcam's frames to drive by.
    """
    page.frame_locator("#view-3d iframe").locator("canvas").first.wait_for()
    page.wait_for_timeout(15_000)  # the meshes arrive
    element = page.query_selector("#view-3d iframe")
    view = element.content_frame() if element else None
    assert view is not None
    view.evaluate(PAUSE)
    return view


def draw_3d(page: Page, view: Frame, times: int = 3) -> None:
    """Let the paused 3D view draw what it knows by now."""
    for _ in range(times):
        view.evaluate(ONE_FRAME)
        page.wait_for_timeout(250)


def drive(server: Server, video: Path) -> None:
    """Everything at a glance, while the arm moves."""
    with driving(server, video, view_3d=True) as page:
        view = pause_3d(page)
        take_and_arm(page)  # loading it may have cost the connection
        wait_for(page, MOVING)
        page.wait_for_timeout(700)
        draw_3d(page, view, 1)
        take(page, "drive")


def first(server: Server, video: Path) -> None:
    """The first minutes: a hand is taught by holding still."""
    with driving(server, video) as page:
        fresh = page.context.browser
        assert fresh is not None
        newcomer = fresh.new_page(viewport={"width": DESK[0], "height": DESK[1]})
        newcomer.set_default_timeout(PATIENCE_MS)
        newcomer.add_init_script(person_script())
        page.close()
        newcomer.goto(server.link)
        wait_for(newcomer, "window.farhand?.state.gesturesState === 'ready'")
        newcomer.click("#btn-start")
        newcomer.click("#first-camera")
        newcomer.wait_for_selector("#whose-name")
        newcomer.fill("#whose-name", "Anna")
        newcomer.keyboard.press("Enter")
        newcomer.wait_for_selector("#sheet-first[data-step=teach]")
        newcomer.wait_for_selector("#sheet-first .first-drawing[src*=left]")
        newcomer.wait_for_timeout(1200)
        take(newcomer, "first-minutes")


def glass(server: Server, video: Path) -> None:
    """The glass box open beside the webcam."""
    with driving(server, video) as page:
        page.click("#glass-toggle")
        reached = "document.querySelectorAll('#glass-body [data-stage]')"
        wait_for(page, f"[...{reached}].every((step) => step.dataset.reached === 'yes')")
        wait_for(page, MOVING)
        take(page, "glass-box")


def view_3d(server: Server, video: Path) -> None:
    """The 3D view large: cameras with their pictures, the trail, the workspace."""
    with driving(server, video, view_3d=True) as page:
        page.evaluate(LARGE_3D)
        view = pause_3d(page)
        take_and_arm(page)  # loading it may have cost the connection
        wait_for(page, MOVING)
        page.wait_for_timeout(1800)
        draw_3d(page, view)
        take(page, "view-3d")


def dry_run(server: Server, video: Path) -> None:
    """A program is tried before it is saved: its way in 3D, and the limit that it meets."""
    with driving(server, video, view_3d=True) as page:
        page.click("#btn-control")  # nothing is to move meanwhile
        pause = pause_3d(page)
        page.get_by_role("button", name="Change “home”").click()
        form = page.locator("#sheet-teach .action-form").first
        form.locator("select[name=kind]").first.select_option("sequence")
        steps = page.locator("#sheet-teach .step-list > li")
        for number, (axis, way) in enumerate((("y", "30"), ("z", "-45"))):
            step = steps.nth(number)
            step.locator("select[name=kind]").select_option("move_linear")
            step.locator("[name=offset-x]").fill("0")
            step.locator(f"[name=offset-{axis}]").fill(way)
        page.locator("#sheet-teach select[name=from]").select_option("home")
        page.click("#action-check")
        page.wait_for_selector("#check-result .check-title")
        page.wait_for_timeout(6000)  # the ghost's meshes arrive
        draw_3d(page, pause, 6)
        take(page, "dry-run")


def teach(server: Server, video: Path) -> None:
    """A new gesture from one picture."""
    with driving(server, video) as page:
        page.click("#teach-open")
        page.fill("#teach-name", "wave")
        page.click("#capture-one")
        page.wait_for_selector(".stills li")
        take(page, "teach")


def people(server: Server, video: Path) -> None:
    """One drives, another asks for control."""
    with driving(server, video) as page:
        chromium = page.context.browser
        assert chromium is not None
        other = chromium.new_page()
        other.set_default_timeout(PATIENCE_MS)
        other.goto(server.link)
        wait_for(other, "window.farhand?.robot?.controller")
        other.click("#btn-control")
        other.click("#sheet-take-over [data-part=ask]")
        page.bring_to_front()
        page.wait_for_selector("#asking .notice")
        take(page, "people")


def phone(server: Server, video: Path) -> None:
    """The same on a phone."""
    with driving(server, video, PHONE) as page:
        wait_for(page, MOVING)
        page.wait_for_timeout(400)
        take(page, "phone")


SCENES: dict[str, Callable[[Server, Path], None]] = {
    "drive": drive,
    "first": first,
    "glass": glass,
    "view_3d": view_3d,
    "dry_run": dry_run,
    "teach": teach,
    "people": people,
    "phone": phone,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SCENES)}; all")
    names = parser.parse_args().names or list(SCENES)
    if unknown := set(names) - set(SCENES):
        parser.error(f"there is no picture {', '.join(sorted(unknown))}")
    PICTURES.mkdir(exist_ok=True)
    draw_gestures()
    with tempfile.TemporaryDirectory() as folder:
        video = webcam((Step(None, 0.6), Step("left", 2.5)), Path(folder) / "left.mjpeg")
        server = start_server(Path(folder))
        try:
            for name in names:
                SCENES[name](server, video)
                print(name, flush=True)
        finally:
            stop_server(server)


if __name__ == "__main__":
    main()
