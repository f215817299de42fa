"""Driving without a hand in the picture: by keys, by buttons, by a gamepad."""

import time
from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import ARMED, MINE, Server, press_until, wait_for

Press = Callable[[], object]
PAD = """
window.pad = null;
navigator.getGamepads = () => window.pad ? [window.pad] : [];
window.push = (axes, ...down) => {
    const one = (each) => ({pressed: down.includes(each), value: 0});
    const buttons = Array.from({length: 17}, (_, each) => one(each));
    window.pad = {connected: true, mapping: "standard", axes, buttons};
};
"""
"""No machine of ours has a gamepad; this is the browser's own interface to one."""


def tool(page: Page, axis: int) -> float:
    """m"""
    return float(page.evaluate(f"window.farhand.robot.tool.position[{axis}]"))


def moved(page: Page, axis: int, way: float) -> str:
    """That the tool has come ``way`` (m, with its sign) along ``axis`` from where it is now."""
    sign = 1 if way > 0 else -1
    start = tool(page, axis)
    return f"{sign} * (window.farhand.robot.tool.position[{axis}] - {start}) > {abs(way)}"


def hold(page: Page, press: Press, let_go: Press, until: str) -> None:
    """Hold something until it has had its effect; anew when the arm held still meanwhile.

    On a starved machine the robot's pictures come late, and the arm rightly waits.
    """
    give_up = time.monotonic() + 120
    while True:
        press()
        while page.evaluate("window.farhand.robot.mode") != "holding":
            if page.evaluate(until):
                let_go()
                rests(page)
                return
            assert time.monotonic() < give_up, until
            page.wait_for_timeout(20)
        let_go()
        rests(page)


def rests(page: Page) -> None:
    wait_for(page, "window.farhand.robot.mode === 'armed'")


def test_the_arm_moves_while_a_key_or_a_button_or_a_stick_is_held(
    server: Server, open_page: OpenPage
) -> None:
    page = open_page("about:blank")
    page.add_init_script(PAD)
    page.goto(server.link)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    page.click("#choose-keys")
    expect(page.locator("#jog [data-move=forward]")).to_be_visible()

    expect(page.locator("#operator-title")).to_have_text("Keys")

    # Nothing is armed by a key that is held.
    press_until(page, "#btn-control", MINE)
    expect(page.locator("#btn-arm")).to_be_enabled()
    page.keyboard.down("ArrowUp")
    press_until(page, "#btn-arm", ARMED)
    expect(page.locator("#sentence")).to_contain_text("let go and press it again")
    assert page.evaluate("window.farhand.robot.mode") != "moving"
    page.keyboard.up("ArrowUp")
    rests(page)
    expect(page.locator("#sentence")).to_have_text("Ready. Hold a button or a key.")

    keys = page.keyboard
    forward = page.locator("#jog [data-move=forward]")
    shown = "document.querySelector('#jog [data-move=forward]').ariaPressed === 'true'"
    hold(page, lambda: keys.down("ArrowUp"), lambda: keys.up("ArrowUp"),
         f"{moved(page, 0, 0.02)} && {shown}")  # fmt: skip
    expect(forward).to_have_attribute("aria-pressed", "false")

    # A button, by a pointer and by the keyboard.
    page.locator("#jog [data-move=down]").hover()
    hold(page, page.mouse.down, page.mouse.up, moved(page, 2, -0.015))
    page.locator("#jog [data-move=up]").focus()
    hold(page, lambda: keys.down("Enter"), lambda: keys.up("Enter"), moved(page, 2, 0.015))

    # A joint that was picked by its number.
    before = page.evaluate("window.farhand.robot.joints[5]")
    keys.press("6")
    hold(page, lambda: keys.down("+"), lambda: keys.up("+"),
         f"window.farhand.robot.joints[5] > {before} + 0.05")  # fmt: skip

    # A stick moves nothing without a shoulder button, and with one as fast as it is pushed.
    y = tool(page, 1)
    page.evaluate("push([-1, 0, 0, 0])")
    page.wait_for_timeout(300)
    assert abs(tool(page, 1) - y) < 0.001
    half = "Math.abs(window.farhand.robot.scale - 0.5) < 0.01"
    hold(page, lambda: page.evaluate("push([-0.625, 0, 0, 0], 5)"),
         lambda: page.evaluate("push([0, 0, 0, 0], 5)"),
         f"{moved(page, 1, 0.01)} && {half}")  # fmt: skip

    # Another window takes the focus: the key's going up would never be heard of.
    hold(page, lambda: keys.down("PageUp"),
         lambda: page.evaluate("window.dispatchEvent(new Event('blur'))"),
         "window.farhand.robot.mode === 'moving'")  # fmt: skip
    keys.up("PageUp")

    # Space stops, with a key held, and reset and arming begin nothing.
    page.keyboard.down("ArrowDown")
    page.keyboard.press(" ")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")
    page.keyboard.up("ArrowDown")

    page.click("#source-stop")
    expect(page.locator("#jog")).to_be_hidden()
