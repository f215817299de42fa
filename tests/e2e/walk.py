"""Every state and every sheet of the page, one after another, on a real server."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from playwright.sync_api import Page, WebSocketRoute, expect

from tests.e2e.person import person_script
from tests.e2e.running import Server, press_until, take_and_arm, wait_for


@dataclass
class Wire:
    """The page's WebSocket to the server. What others do, and what breaks, is told on it."""

    robot: dict[str, Any] = field(default_factory=dict)
    """In place of what the server says of the robot."""
    people: dict[str, Any] = field(default_factory=dict)
    """In place of what it says of who is here."""
    cut: bool = False
    """No connection comes to be."""
    routes: list[WebSocketRoute] = field(default_factory=list)

    def attach(self, page: Page) -> None:
        """Before the page is opened."""
        page.route_web_socket("**/ws/operator", self._connect)

    def close(self) -> None:
        """The connection ends, and none comes to be."""
        self.cut = True
        self.routes[-1].close()

    def _connect(self, route: WebSocketRoute) -> None:
        if self.cut:
            route.close()
            return
        server = route.connect_to_server()
        server.on_message(lambda text: route.send(self._told(text)))
        self.routes.append(route)

    def _told(self, text: str | bytes) -> str | bytes:
        message = json.loads(text) if isinstance(text, str) else {}
        changes = {"robot": self.robot, "people": self.people}.get(message.get("type", ""))
        return json.dumps({**message, **changes}) if changes else text


def opened(page: Page, server: Server, language: str = "en") -> Wire:
    """Open the server's page with a person before its webcam."""
    wire = Wire()
    wire.attach(page)
    page.add_init_script(person_script())
    page.add_init_script(f"localStorage.setItem('farhand-language', '{language}')")
    page.goto(server.link)
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    wait_for(page, "window.farhand.state.gesturesState === 'ready'")
    wait_for(page, "window.farhand.state.description")
    return wire


def press(page: Page, where: str) -> None:
    """A click that does not ask what lies over the button."""
    page.locator(where).dispatch_event("click")


def sheet(page: Page, name: str) -> None:
    page.wait_for_selector(f"#sheet-{name}")


def close(page: Page) -> None:
    press(page, ".sheet [data-part=close]")
    expect(page.locator(".sheet")).to_have_count(0)


def walk(page: Page, wire: Wire) -> Iterator[str]:
    """Lead an opened page through its states; yields the name of each while the page is in it."""
    yield "open"
    yield from _sheets(page)
    yield from _first_minutes(page)
    yield from _driving(page, wire)
    yield from _troubles(page, wire)


def _sheets(page: Page) -> Iterator[str]:
    press(page, "#help-open")
    sheet(page, "help")
    yield "help"
    press(page, "#preflight-open")
    sheet(page, "preflight")
    page.wait_for_selector("#sheet-preflight [data-done]")
    yield "preflight"
    close(page)
    press(page, "#btn-reset-scene")
    sheet(page, "reset-scene")
    yield "reset-scene"
    close(page)
    press(page, "#teach-open")
    sheet(page, "teach")
    page.locator("#sheet-teach select[name=kind]").first.select_option("sequence")
    yield "teach"
    close(page)


def _first_minutes(page: Page) -> Iterator[str]:
    for pressed, step in (("btn-start", "source"), ("first-camera", "whose")):
        press(page, f"#{pressed}")
        page.wait_for_selector(f"#sheet-first[data-step={step}]")
        yield f"first-{step}"
    page.fill("#whose-name", "Anna")
    page.keyboard.press("Enter")
    for pressed, step in (("", "check"), ("first-go", "teach")):
        if pressed:
            press(page, f"#{pressed}")
        page.wait_for_selector(f"#sheet-first[data-step={step}]")
        page.evaluate("person.follows = false; person.show(null)")
        yield f"first-{step}"
    close(page)
    press(page, "#whose-open")
    sheet(page, "whose")
    yield "whose"
    close(page)
    # Those who have taught nothing are led on by a drawn hand.
    press(page, "#source-stop")
    press(page, "#btn-start")
    page.wait_for_selector("#sheet-first[data-step=source]")
    press(page, "#first-synthetic")
    page.wait_for_selector("#sheet-first[data-step=drive]")
    yield "first-drive"
    close(page)


def _driving(page: Page, wire: Wire) -> Iterator[str]:
    press(page, "#source-stop")
    press(page, "#choose-camera")
    press(page, "#glass-toggle")
    page.evaluate("person.show('forward')")
    page.wait_for_selector("#glass-body [data-stage=projection][data-reached=yes]")
    wire.robot = {"controller": "operator-9"}
    wait_for(page, "window.farhand.robot.controller === 'operator-9'")
    press(page, "#btn-control")
    sheet(page, "take-over")
    yield "take-over"
    close(page)
    wire.robot = {}
    wait_for(page, "!window.farhand.robot.controller")
    take_and_arm(page, press)
    wire.people = {"asking": ["operator-9"]}
    press(page, "#latency-bar")
    press(page, "#fine")
    yield "driving"
    press(page, "#source-stop")
    press(page, "#choose-keys")
    page.wait_for_selector("#jog [data-move=forward]")
    yield "keys"
    press(page, "#stop")
    wait_for(page, "window.farhand.robot.mode === 'stopped'")
    yield "stopped"
    press_until(page, "#btn-reset", "window.farhand.robot.mode === 'disarmed'", click=press)


def _troubles(page: Page, wire: Wire) -> Iterator[str]:
    page.evaluate(NO_CAMERA)
    press(page, "#source-stop")
    press(page, "#choose-camera")
    page.wait_for_selector("#source-retry")
    yield "no-camera"
    wire.robot = {"fault": "robot node crashed (exit code 1)", "mode": "faulted"}
    page.wait_for_selector(".mode-faulted")
    yield "fault"
    wire.close()
    page.wait_for_selector("#gone-retry")
    yield "gone"
    page.context.clear_cookies()
    wait_for(page, "window.farhand.state.connection.state === 'signed-out'")
    yield "signed-out"


NO_CAMERA = """
() => {
    const refuse = () => Promise.reject(new DOMException("", "NotFoundError"));
    navigator.mediaDevices.getUserMedia = refuse;
}
"""

Look = Callable[[Page], None]
"""Gives the page a size and a scheme of colours."""


def look(width: int, height: int, scheme: Any) -> Look:
    def give(page: Page) -> None:
        page.set_viewport_size({"width": width, "height": height})
        page.emulate_media(color_scheme=scheme)

    return give


DESK, PHONE = (1280, 800), (360, 740)
EVERY_LOOK = [look(*size, scheme) for size in (DESK, PHONE) for scheme in ("light", "dark")]
TWO_LOOKS = [look(*DESK, "light"), look(*PHONE, "dark")]
