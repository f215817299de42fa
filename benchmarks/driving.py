"""A real browser that drives: Chromium, the page, a fake webcam that plays the drawn hand."""

import contextlib
import shutil
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil
from playwright.sync_api import Page, sync_playwright

from app.gestures.synthetic import Step, SyntheticOperator, write_mjpeg
from tests.e2e.running import BASE_ARGUMENTS, Server, take_and_arm, wait_for


def webcam(script: Sequence[Step], path: Path) -> Path:
    """Write what the fake webcam plays, over and over."""
    write_mjpeg(SyntheticOperator(script).frames(), path)
    return path


@contextmanager
def browser(server: Server, video: Path, *, view_3d: bool = False) -> Iterator[Page]:
    """A page that is signed in, has its camera on and the robot armed."""
    executable = shutil.which("chromium")
    if executable is None:
        raise RuntimeError("no Chromium on this machine (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=executable,
            args=[
                *BASE_ARGUMENTS,
                "--use-fake-ui-for-media-stream",
                f"--use-file-for-fake-video-capture={video}",
            ],
        )
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.add_init_script(
            f"localStorage.setItem('farhand-hide-3d', '{'no' if view_3d else 'yes'}')"
        )
        page.goto(server.link)
        wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
        page.click("#choose-camera")
        wait_for(page, "window.farhand.frame !== null")
        take_and_arm(page)
        yield page
        if chromium.is_connected():
            chromium.close()


def signal_browser(number: signal.Signals) -> None:
    """Send a signal to every Chromium that this process started, without a word before."""
    for child in psutil.Process().children(recursive=True):
        if "chrom" in child.name():
            with contextlib.suppress(psutil.NoSuchProcess):
                child.send_signal(number)
