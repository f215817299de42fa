"""Driving without a hand in the picture: by keys, by buttons, by a gamepad."""

from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import Server, wait_for

SLOW = 60_000
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


def moved(page: Page, axis: int, start: float, way: float) -> None:
    """Wait until the tool has come ``way`` (m, with its sign) along ``axis``."""
    sign = 1 if way > 0 else -1
    wait_for(page, f"{sign} * (window.farhand.robot.tool.position[{axis}] - {start}) > {abs(way)}")


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
    expect(page.locator("#jog [data-move=forward]")).to_be_visible(timeout=SLOW)

    # Nothing is armed by a key that is held.
    page.click("#btn-control")
    wait_for(page, "window.farhand.robot.controller === window.farhand.hello.session")
    page.keyboard.down("ArrowUp")
    page.click("#btn-arm")
    wait_for(page, "window.farhand.robot.armed")
    expect(page.locator("#sentence")).to_contain_text("let go and press it again", timeout=SLOW)
    assert page.evaluate("window.farhand.robot.mode") != "moving"
    page.keyboard.up("ArrowUp")
    rests(page)
    expect(page.locator("#sentence")).to_have_text("Ready. Hold a button or a key.", timeout=SLOW)

    x = tool(page, 0)
    page.keyboard.down("ArrowUp")
    moved(page, 0, x, 0.02)
    expect(page.locator("#jog [data-move=forward]")).to_have_attribute("aria-pressed", "true")
    page.keyboard.up("ArrowUp")
    rests(page)

    # A button, by a pointer and by the keyboard.
    z = tool(page, 2)
    down = page.locator("#jog [data-move=down]")
    down.hover()
    page.mouse.down()
    moved(page, 2, z, -0.015)
    page.mouse.up()
    rests(page)
    z = tool(page, 2)
    page.locator("#jog [data-move=up]").focus()
    page.keyboard.down("Enter")
    moved(page, 2, z, 0.015)
    page.keyboard.up("Enter")
    rests(page)

    # A joint that was picked by its number.
    before = page.evaluate("window.farhand.robot.joints[5]")
    page.keyboard.press("6")
    page.keyboard.down("+")
    wait_for(page, f"window.farhand.robot.joints[5] > {before} + 0.05")
    page.keyboard.up("+")
    rests(page)

    # A stick moves nothing without a shoulder button, and the arm as fast as it is pushed with one.
    y = tool(page, 1)
    page.evaluate("push([-1, 0, 0, 0])")
    page.wait_for_timeout(300)
    assert abs(tool(page, 1) - y) < 0.001
    page.evaluate("push([-0.625, 0, 0, 0], 5)")
    moved(page, 1, y, 0.01)
    assert abs(page.evaluate("window.farhand.robot.scale") - 0.5) < 0.01
    page.evaluate("push([0, 0, 0, 0], 5)")
    rests(page)

    # Another window takes the focus: the key's going up would never be heard of.
    page.keyboard.down("PageUp")
    wait_for(page, "window.farhand.robot.mode === 'moving'")
    page.evaluate("window.dispatchEvent(new Event('blur'))")
    rests(page)
    page.keyboard.up("PageUp")

    # Space stops, with a key held, and reset and arming begin nothing.
    page.keyboard.down("ArrowDown")
    wait_for(page, "window.farhand.robot.mode === 'moving'")
    page.keyboard.press(" ")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")
    page.keyboard.up("ArrowDown")

    page.click("#source-stop")
    expect(page.locator("#jog")).to_be_hidden()
