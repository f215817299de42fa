"""Keys and Tab without a server: who hears them while a sheet is open."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page

from tests.e2e.running import STATIC, run

pytestmark = pytest.mark.e2e

ROBOT = {
    "joints": [{"name": f"joint{n}", "unit": "rad", "velocity": 1.0} for n in (1, 2, 3)],
    "poses": {"home": [0, 0, 0]},
    "gripper_max": 0.08,
    "drives": False,
}

COCKPIT = """
const [{ Sheets }, { jogPad }, { Held }, { Store }, { keys }] = await Promise.all(
    ["ui/sheets.js", "ui/jog.js", "core/held.js", "core/store.js", "ui/keys.js"]
        .map((name) => import(`/static/${name}`)));
document.body.replaceChildren();
const place = (tag) => document.body.appendChild(document.createElement(tag));
const [before, pad, host, dock] = ["button", "div", "div", "footer"].map(place);
const button = (id) => Object.assign(document.createElement("button"), { id });
dock.append(button("one"), button("stop"));
const sheets = new Sheets(host, [dock]);
const store = new Store({ description: a.robot, gestures: [] });
const held = new Held({ tick: 1, send: () => true });
const jog = jogPad(pad, store, { held, mayPress: () => !sheets.name, stop: () => {} });
held.start();
const wishes = [];
document.body.addEventListener("farhand:want", ({ detail }) => wishes.push(detail.what));
const press = (key, more = {}) => {
    for (const type of ["keydown", "keyup"]) {
        const about = { key, code: key, bubbles: true, cancelable: true, ...more };
        (document.activeElement || document.body).dispatchEvent(new KeyboardEvent(type, about));
        if (type === "keydown") seen.push(held.id);
    }
};
const seen = [];
const picked = () => pad.querySelector("[aria-live]").textContent;
"""


def cockpit(modules: Page, script: str) -> Any:
    return run(modules, "ui/dom.js", COCKPIT + script, {"robot": ROBOT})


def test_a_sheet_has_the_keys_to_itself(modules: Page) -> None:
    """The pad's digits and letters mean nothing while somebody teaches beside it."""
    script = """
        keys(document.body, { closeSheet: () => sheets.close(), canMove: () => false, jog });
        const all = ["2", "+", "ArrowUp", "o", "g", "h", "s", "b", "r"];
        sheets.show("first", "Teach", []);
        for (const key of all) press(key);
        const open = [seen.splice(0), picked(), [...wishes]];
        sheets.close();
        for (const key of all) press(key);
        held.stop();
        return [open, [seen, picked()]];
    """
    (pressed, picked, wishes), (moved, chosen) = cockpit(modules, script)
    assert set(pressed) == {None}
    assert "J1" in picked
    assert wishes == []
    assert moved == [None, "joint-2+", "forward", "open", "close", "home", None, None, None]
    assert "J2" in chosen


def test_the_stop_keys_stop_from_a_list_too_while_anything_can_move(modules: Page) -> None:
    script = """
        let moves = true;
        keys(document.body, { closeSheet: () => false, canMove: () => moves, jog });
        const list = document.body.appendChild(document.createElement("select"));
        const typed = document.body.appendChild(document.createElement("input"));
        const all = [];
        for (const [field, can] of [[list, true], [list, false], [typed, true]]) {
            moves = can;
            field.focus();
            press(" ");
            press("a");
            press("Escape");
            all.push(wishes.splice(0));
        }
        held.stop();
        return all;
    """
    assert cockpit(modules, script) == [["stop", "stop"], [], []]


def test_no_letter_means_two_things() -> None:
    def letters(name: str, pattern: str) -> set[str]:
        code = (STATIC / name).read_text()
        return {letter.lower() for letter in re.findall(pattern, code)}

    page = letters("ui/keys.js", r'\b(\w): "[\w-]+"')
    pad = letters("ui/moves.js", r'key: "(\w)"')
    teaching = letters("ui/first/teach-all.js", r'"aria-keyshortcuts": "(\w)"')
    assert page == {"a", "c", "f", "w"}
    assert pad == {"o", "g", "h"}
    assert teaching == {"b", "r", "s"}
    assert not page & pad and not page & teaching and not pad & teaching


def test_tab_goes_round_a_sheet_and_what_is_beside_it(modules: Page) -> None:
    script = """
        before.textContent = "Open";
        before.focus();
        const field = document.createElement("input");
        const off = Object.assign(document.createElement("button"), { disabled: true });
        sheets.show("help", "Help", [field, off]);
        const where = () => {
            const at = document.activeElement;
            return at.dataset.part || at.id || at.localName;
        };
        const tab = (shiftKey) => { press("Tab", { shiftKey }); return where(); };
        const walked = [where(), ...[1, 2, 3, 4, 5].map(() => tab(false))];
        const back = [1, 2].map(() => tab(true));
        before.focus(); // somebody points at the cockpit meanwhile
        const led = tab(false);
        sheets.close();
        const given = document.activeElement === before;
        press("Tab");
        held.stop();
        return [walked, back, led, given, document.activeElement === before];
    """
    walked, back, led, given, free = cockpit(modules, script)
    assert walked == ["help-title", "close", "input", "one", "stop", "close"]
    assert back == ["stop", "one"]
    assert led == "close"
    assert given
    assert free, "with no sheet open nobody leads Tab"
