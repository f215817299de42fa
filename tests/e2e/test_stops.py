"""Whoever stops the robot, and however: everybody sees the same."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.gateway.tokens import TokenStore
from tests.e2e.conftest import OpenPage
from tests.e2e.person import person_script
from tests.e2e.running import MINE, TOKEN, Server, press_until, take_and_arm, wait_for

pytestmark = pytest.mark.e2e

FACE = """() => {
    const text = (id) => document.getElementById(id).innerText;
    const seen = [...document.querySelectorAll("#dock-buttons button, #steps li")];
    return {
        mode: farhand.robot.mode,
        stop: farhand.robot.stop,
        armed: farhand.robot.armed,
        pill: [text("state-pill"), document.getElementById("state-pill").dataset.mode],
        button: [text("stop"), document.getElementById("stop").dataset.state],
        steps: seen.map((one) => [one.innerText, one.className, one.checkVisibility()]),
        root: [...document.documentElement.classList].sort(),
        sentence: text("sentence").replace(/Stopped: .*?\\. /, "Stopped: WHY. "),
        notices: text("notices"),
    };
}"""


def stopped(page: Page, why: str) -> dict[str, Any]:
    """What the page shows once the robot has stopped."""
    wait_for(page, "window.farhand.robot?.mode === 'stopped'")
    expect(page.locator("#sentence")).to_contain_text(f"Stopped: {why}")
    expect(page.locator("#stop")).to_have_attribute("data-state", "stopped")
    expect(page.locator("#notices .notice")).to_have_count(0)
    face = page.evaluate(FACE)
    assert isinstance(face, dict)
    return face


def test_button_key_and_gesture_stop_alike_for_who_drives_and_who_watches(
    server: Server, open_page: OpenPage
) -> None:
    drives = open_page("about:blank")
    drives.add_init_script(person_script())
    drives.goto(server.link)
    secret = TokenStore(server.data_dir / "tokens.json").make("observer", "Anna").secret
    watches = open_page(server.link.replace(TOKEN, secret))
    wait_for(drives, "window.farhand?.robot?.mode === 'disarmed'")
    drives.evaluate("person.follows = false")
    drives.click("#choose-camera")
    press_until(drives, "#btn-control", MINE)
    name = drives.evaluate("window.farhand.hello.session")

    ways = {
        "button": (lambda: drives.click("#stop"), f"stop was pressed ({name})"),
        "key": (lambda: drives.keyboard.press("Space"), f"stop was pressed ({name})"),
        "gesture": (
            lambda: drives.evaluate("person.show('stop')"),
            f"the gesture 'stop' was shown ({name})",
        ),
    }
    operators, observers = {}, {}
    for way, (stop, why) in ways.items():
        wait_for(drives, "window.farhand.robot.mode === 'disarmed'")
        take_and_arm(drives)
        stop()
        operators[way] = stopped(drives, why)
        observers[way] = stopped(watches, why)
        drives.evaluate("person.show(null)")
        press_until(drives, "#btn-reset", "window.farhand.robot.mode === 'disarmed'")
    for faces in (operators, observers):
        assert faces["key"] == faces["button"]
        assert faces["gesture"] == faces["button"]
    assert operators["button"]["stop"] == "S1"
    for what in ("mode", "stop", "armed", "pill", "button"):
        assert observers["button"][what] == operators["button"][what], what

    # Who only watches stops the robot for everybody, too.
    wait_for(drives, "window.farhand.robot.mode === 'disarmed'")
    watcher = watches.evaluate("window.farhand.hello.session")
    watches.keyboard.press("Space")
    assert stopped(watches, f"stop was pressed ({watcher})") == observers["button"]
    stopped(drives, f"stop was pressed ({watcher})")
