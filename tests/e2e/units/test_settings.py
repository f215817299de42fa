"""What a person chose: kept in the browser, and told to the server."""

from typing import Any

from playwright.sync_api import Page

from tests.e2e.running import run

KEEPER = """
const told = [];
const refusals = [...a];
const api = {
    async settings() { return {}; },
    async changeSettings(gallery, changes) {
        told.push([gallery, changes]);
        const error = refusals.shift();
        if (error) throw error;
    },
};
const kept = {};
const memory = { get: (name) => kept[name] ?? null, set: (name, value) => { kept[name] = value; } };
const state = { gallery: "anna", hello: null, connection: { state: "connecting" } };
const store = { state, watch: (keys, listener) => listener(state) };
const keeper = new m.SettingsKeeper(api, store, memory);
"""


def play(page: Page, script: str, *refusals: Any) -> Any:
    return run(page, "core/settings.js", f"{KEEPER} {script}", list(refusals))


def test_who_leaves_at_once_after_choosing_has_chosen(modules: Page) -> None:
    script = """
    keeper.set("speed", "0.4");
    keeper.set("fine", "yes");
    window.dispatchEvent(new Event("pagehide"));
    return told;
    """
    assert play(modules, script) == [["anna", {"speed": 0.4, "fine": True}]]


def test_what_could_not_be_told_is_told_with_the_next(modules: Page) -> None:
    script = """
    keeper.set("glass", "open");
    await keeper.flush();
    keeper.set("large", "scene");
    await keeper.flush();
    return told;
    """
    first, second = play(modules, script, {"status": 503})
    assert first == ["anna", {"glass": True}]
    assert second == ["anna", {"glass": True, "large": "scene"}]


def test_what_was_refused_is_not_told_again(modules: Page) -> None:
    script = """
    keeper.set("glass", "open");
    await keeper.flush();
    await keeper.flush();
    return told;
    """
    assert play(modules, script, {"status": 422}) == [["anna", {"glass": True}]]


def test_the_shared_gallery_is_nobody_and_keeps_nothing(modules: Page) -> None:
    script = """
    state.gallery = "shared";
    keeper.set("glass", "open");
    await keeper.flush();
    return [told, keeper.get("glass")];
    """
    assert play(modules, script) == [[], "open"]
