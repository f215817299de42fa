"""The check of the browser."""

from playwright.sync_api import Page

from tests.e2e.running import run


def test_every_finding_of_the_check_has_words(modules: Page) -> None:
    codes = {"camera": ("denied", "none", "busy", "insecure", "unsupported", "odd")}
    codes |= {"socket": ("blocked",), "webgl": ("off",)}
    for what, problems in codes.items():
        for code in ("fine", *problems):
            finding = {"what": what, "code": code}
            said = run(modules, "ui/preflight.js", "return m.describeFinding(a)", finding)
            assert said["title"], finding
            assert bool(said["words"]) is (code != "fine"), finding


def test_the_check_finds_what_is_missing(modules: Page) -> None:
    # The server of these tests has no WebSockets, and nobody allows the camera here.
    script = "const all = []; await m.preflight((f) => all.push(f)); return all"
    found = {each["what"]: each["code"] for each in run(modules, "core/preflight.js", script)}
    assert list(found) == ["socket", "camera", "webgl"]
    assert found["socket"] == "blocked"
    assert found["camera"] in ("denied", "none")
