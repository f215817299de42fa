"""The main job: a hand shown to a webcam in a browser moves the arm in another process."""

import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.gateway.tokens import TokenStore
from app.gestures.synthetic import Step, SyntheticOperator, write_mjpeg
from tests.e2e.conftest import OpenPage
from tests.e2e.running import TOKEN, Server, press_until, put_at_rest, take_and_arm, wait_for

pytestmark = pytest.mark.e2e

"""ms; these machines are slow now and then, and no test here is about speed."""


@pytest.fixture
def server(one_server: Server) -> Iterator[Server]:
    """The same for all, and as it was at the start for each."""
    yield one_server
    put_at_rest(one_server)


@pytest.fixture(scope="module")
def showing_up(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A webcam that shows ``up`` for two seconds, then no hand, over and over."""
    path = tmp_path_factory.mktemp("webcam") / "webcam.mjpeg"
    write_mjpeg(SyntheticOperator((Step(None, 1.0), Step("up", 2.0))).frames(), path)
    return path


def start_driving(page: Page) -> None:
    """Camera on, control taken, armed: as a person does it, by the buttons."""
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    page.click("#choose-camera")
    wait_for(page, "window.farhand.frame !== null")
    take_and_arm(page)


def height(page: Page) -> float:
    """Of the tool above the robot's base, m."""
    return float(page.evaluate("window.farhand.robot.tool.position[2]"))


def test_a_hand_shown_to_the_webcam_moves_the_arm_and_the_page_shows_it(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    assert "token" not in page.url
    start_driving(page)
    low = height(page)
    joints = page.evaluate("window.farhand.robot.joints")

    wait_for(page, "window.farhand.robot.mode === 'moving'")
    cause = page.evaluate("window.farhand.robot.seq")
    assert isinstance(cause, int), "the motion names the frame that caused it"
    wait_for(page, f"window.farhand.robot.tool.position[2] > {low + 0.05}")
    assert page.evaluate("window.farhand.robot.joints") != joints
    # It says how the hand is told from the room, and why so.
    page.click("#glass-toggle")
    expect(page.locator("#seen-mask")).to_have_text(
        re.compile("^(hand landmarks$|(learned mask|plain threshold), because the background )")
    )

    # When the hand is gone the arm comes to rest by itself, still armed, and nothing is wrong.
    wait_for(page, "window.farhand.robot.mode === 'armed'")
    assert page.evaluate("window.farhand.robot.fault") is None


def test_both_cameras_and_the_3d_view_show_the_robot(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    wait_for(page, "window.farhand?.pictures.wrist > 5 && window.farhand.pictures.scene > 5")
    # Where WebGL is slow the page asks before it shows the 3D view.
    page.wait_for_selector("#view-3d iframe, #show-3d")
    if page.is_visible("#show-3d"):
        page.click("#show-3d")
    view = page.frame_locator("#view-3d iframe")
    canvas = view.locator("canvas").first
    expect(canvas).to_be_visible()
    # The picture of the canvas itself, since WebGL clears its buffer after each frame.
    for _ in range(120):
        colours = set(_colours(canvas.screenshot()))
        if len(colours) > 50:
            break
        page.wait_for_timeout(500)
    assert len(colours) > 50, "the 3D view is blank"


def _colours(png: bytes) -> list[int]:
    import cv2
    import numpy as np

    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    packed = picture.astype(np.uint32) @ np.array([1, 256, 65536], np.uint32)
    return [int(colour) for colour in np.unique(packed)]


def test_stop_latches_until_reset_and_arming(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    start_driving(page)
    wait_for(page, "window.farhand.robot.mode === 'moving'")
    page.keyboard.press("Space")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")

    # Gestures go on being shown, and nothing moves.
    count = page.evaluate("window.farhand.counts.gesture")
    stood = page.evaluate("window.farhand.robot.joints")
    wait_for(page, f"window.farhand.counts.gesture > {count + 20}")
    now = page.evaluate("window.farhand.robot.joints")
    assert now == pytest.approx(stood, abs=2e-3)

    press_until(page, "#btn-reset", "window.farhand.robot.mode === 'disarmed'")
    take_and_arm(page)
    wait_for(page, "window.farhand.robot.mode === 'moving'")


def test_speed_and_fine_reach_the_robot_are_remembered_and_leave_the_stop_key_alone(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    assert page.is_hidden("#speed")
    start_driving(page)
    page.keyboard.press("f")
    wait_for(page, "window.farhand.robot.scale === 0.2")
    expect(page.locator("#speed-value")).to_have_text("20%")
    expect(page.locator("#fine")).to_have_attribute("aria-pressed", "true")
    page.click("#fine")
    wait_for(page, "window.farhand.robot.scale === 1")
    page.focus("#speed")
    page.keyboard.press("ArrowLeft")
    wait_for(page, "window.farhand.robot.scale === 0.95")
    page.keyboard.press("Space")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")

    page.reload()
    wait_for(page, "window.farhand?.state.speed === 0.95")


def test_things_are_put_back_when_asked_twice(server: Server, open_page: OpenPage) -> None:
    page = open_page(server.link)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    # An arm that has just been let down upon its brakes still settles.
    wait_for(page, "window.farhand.robot.velocities.every((each) => Math.abs(each) < 0.001)")
    page.click("#btn-reset-scene")
    expect(page.locator("#sheet-reset-scene")).to_contain_text("The arm does not move")
    page.click("#sheet-reset-scene [data-part=yes]")
    expect(page.locator(".notice.good")).to_have_text("Everything is back in its place.")


def test_a_killed_node_is_shown_and_comes_back_disarmed(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    start_driving(page)
    os.kill(server.node().pid, signal.SIGKILL)
    wait_for(page, "window.farhand.robot.fault !== null")
    wait_for(
        page, "window.farhand.robot.fault === null && window.farhand.robot.mode === 'disarmed'"
    )
    assert page.evaluate("window.farhand.robot.armed") is False


def test_the_arm_rests_after_the_browser_is_gone(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    start_driving(page)
    wait_for(page, "window.farhand.robot.mode === 'moving'")
    page.close()
    with server.api() as api:
        deadline = time.monotonic() + 20
        while (robot := api.get("/api/robots").json()[0])["controller"] is not None:
            assert time.monotonic() < deadline, robot
            time.sleep(0.05)
        assert robot["mode"] == "disarmed"


def test_the_synthetic_operator_drives_without_a_camera(
    server: Server, open_page: OpenPage
) -> None:
    page = open_page(server.link)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    page.click("#choose-synthetic")
    wait_for(page, "window.farhand.frame !== null")
    take_and_arm(page)
    wait_for(page, "window.farhand.robot.mode === 'moving'")


def test_a_wrong_token_opens_nothing(server: Server, open_page: OpenPage) -> None:
    page = open_page(server.url + "/?token=wrong-" + TOKEN, allow_errors=True)
    expect(page.locator("input")).to_be_visible()
    assert page.evaluate("window.farhand === undefined")


def test_an_observer_watches_and_stops(server: Server, open_page: OpenPage) -> None:
    secret = TokenStore(server.data_dir / "tokens.json").make("observer", "Anna").secret
    page = open_page(server.link.replace(TOKEN, secret))
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    wait_for(page, "window.farhand.pictures.scene > 2")
    for hidden in ("#operator", "#btn-control", "#btn-arm", "#teach-open"):
        assert not page.is_visible(hidden), hidden
    page.keyboard.press("Space")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")
    expect(page.locator("#sentence")).to_contain_text("An operator can reset it")


def test_the_check_of_the_browser_finds_nothing_missing(
    server: Server, open_page: OpenPage, showing_up: Path
) -> None:
    page = open_page(server.link, webcam=showing_up)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    page.click("#help-open")
    page.click("#preflight-open")
    page.wait_for_selector("[data-done]")
    found = page.locator("#preflight li").evaluate_all("all => all.map((li) => li.dataset.code)")
    assert found == ["fine"] * 3
