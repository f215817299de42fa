"""The page's words in their languages: complete, alike in form, and nobody's forgotten."""

import ast
import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

from app.gateway.drive import BY_KEYS
from app.gateway.eyes import PictureAge
from app.robot.controller import DOUBTS
from tests.e2e.running import ROOT, STATIC, run

pytestmark = pytest.mark.e2e

OTHERS = sorted(path.stem for path in (STATIC / "texts").glob("??.js") if path.stem != "en")
FLAT = """
const { texts } = await import(`/static/texts/${a}.js`);
const flat = {};
const marks = Array.from({ length: 6 }, (_, number) => `<${number}>`);
(function walk(level, path) {
    for (const [key, value] of Object.entries(level)) {
        const name = path ? `${path}.${key}` : key;
        if (typeof value === "object") walk(value, name);
        else if (typeof value === "string") flat[name] = ["text", value];
        else {
            const said = [marks, marks.map(() => null), marks.map(() => 2)].map((all) =>
                String(value(...all.slice(0, value.length))));
            flat[name] = [`of ${value.length}`, ...said];
        }
    }
})(texts, "");
return flat;
"""
SAME = {
    "manager.matrix.row",
    "timeline.filters.server",
    "timeline.seconds",
    "title", "stage.age", "glass.nothing", "glass.regionValue", "glass.templateValue",
    "gestures.noDistance", "latency.total", "jog.joint", "jog.pose", "first.teach.tile",
    "readout.joint", "readout.toolValue", "readout.placeValue", "readout.slideValue",
    "account.token", "action.linear", "check.anywhere", "first.stepNames.whose", "headings.readout",
}  # fmt: skip
"""What reads alike in every language: names, signs and figures."""


def flat(modules: Page, language: str) -> dict[str, list[str]]:
    found = run(modules, "texts/texts.js", FLAT, language)
    assert isinstance(found, dict)
    return found


@pytest.mark.parametrize("language", OTHERS)
def test_every_language_says_all_that_english_says(modules: Page, language: str) -> None:
    english, other = flat(modules, "en"), flat(modules, language)
    assert list(other) == list(english)
    for key, (form, *said) in english.items():
        assert other[key][0] == form, key
        for one, same in zip(said, other[key][1:], strict=True):
            assert same.strip() or not one.strip(), key
            assert sorted(set(re.findall("<.>", same))) == sorted(set(re.findall("<.>", one))), key
            assert "undefined" not in same, key


@pytest.mark.parametrize("language", OTHERS)
def test_nothing_was_left_in_english(modules: Page, language: str) -> None:
    english, other = flat(modules, "en"), flat(modules, language)
    alike = {key for key in english if english[key] == other[key]}
    keys = {key for key in alike if re.fullmatch(r"jog\.keys\..*|help\.keys\.\d+\.0", key)}
    assert alike - keys <= SAME


def test_every_module_speaks_the_chosen_language() -> None:
    for path in STATIC.rglob("*.js"):
        named = re.findall(r'"[./]*texts/([\w-]+)\.js"', path.read_text())
        assert set(named) <= {"texts", "forms"}, path
    handler = (STATIC / "error-handler.js").read_text()
    for language in ("en", *OTHERS):
        assert f"        {language}: {{" in handler, (
            "the words that stand where no module is loaded"
        )


@pytest.mark.parametrize(
    ("chosen", "wanted", "expected"),
    [
        (None, ["en-GB", "de"], "en"),
        (None, ["fr", "de-AT", "en"], "de"),
        (None, ["DE"], "de"),
        ("de", ["en"], "de"),
        ("en", ["de"], "en"),
        ("fr", ["de"], "de"),
        ("toString", ["constructor"], "en"),
        (None, [], "en"),
    ],
)
def test_the_person_s_choice_counts_then_the_browser_s(
    modules: Page, chosen: str | None, wanted: list[str], expected: str
) -> None:
    script = "return m.pickLanguage(a[0], a[1])"
    assert run(modules, "texts/texts.js", script, [chosen, wanted]) == expected


TOLD = """
const [{ texts, phrases }, { translator }] = await Promise.all(
    [import("/static/texts/de.js"), import("/static/texts/phrases.js")]);
const told = translator(phrases, texts.numbers.decimal, texts.numbers.quote);
return a.map(told);
"""


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("the robot is not armed", "der Roboter ist nicht freigegeben"),
        ("No hand in the picture", "keine Hand im Bild"),
        (
            "the gesture 'wave' was shown (operator-1)",
            "die Geste „wave“ wurde gezeigt (operator-1)",
        ),
        (
            "the robot holds still: no hand is in the picture: show no gesture for half a second, "
            "then a new one",
            "der Roboter hält still: keine Hand ist im Bild: zeigen Sie eine halbe Sekunde lang "
            "keine Geste, dann eine neue",
        ),
        (
            "unknown hand: closest is two, but too far (0.52, at most 0.40)",
            "unbekannte Hand: am nächsten ist „two“, aber zu weit (0,52, höchstens 0,40)",
        ),
        (
            "slowed: forearm is 12 mm from the table",
            "verlangsamt: Unterarm: noch 12 mm Abstand, Tisch",
        ),
        (
            "step 2 of 3: only 3.0 cm of 10.0 cm can be reached in a straight line: it is out of "
            "the arm's reach",
            "Schritt 2 von 3: nur 3,0 von 10,0 cm sind geradlinig erreichbar: es liegt außerhalb "
            "der Reichweite",
        ),
        ("J2 is at its upper limit", "J2 ist am oberen Anschlag"),
        ("J5 would pass its limit", "J5 käme über seinen Anschlag"),
        ("something that nobody has put into German", None),
        ("", None),
    ],
)
def test_what_the_server_says_is_told_in_german(modules: Page, said: str, told: str | None) -> None:
    assert run(modules, "texts/phrases.js", TOLD, [said]) == [told]


def test_every_doubt_and_every_reason_of_keys_has_its_phrase(modules: Page) -> None:
    age = PictureAge(1500)
    age.saw("wrist", 0)
    reasons = [*DOUBTS.values(), BY_KEYS, age(9000) or ""]
    told = run(modules, "texts/phrases.js", TOLD, reasons)
    assert None not in told and len(set(told)) == len(told)


def literals() -> Iterator[str]:
    """Every text of the server, and the names of the things in its models."""
    for path in (ROOT / "app").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
    for path in (ROOT / "app/robot/models").rglob("*.toml"):
        yield path.read_text().replace("_", " ")


ASSEMBLED = re.compile(
    r"(is at|ends at) its (upper|lower) limit|(turns|moves) at most at|is not a new one"
    r"|s? (is|are) here already|mm from (its own|the)"
    r"|No space left on device|Read-only file system"
)
"""What the server puts together from parts that are too short to be looked for, and what the
operating system says."""


def test_the_server_still_says_what_is_put_into_german(modules: Page) -> None:
    script = "return (await import('/static/texts/de-server.js')).phrases"
    phrases: list[Any] = run(modules, "texts/texts.js", script)
    source = "\n".join(literals())
    for english, german in phrases:
        assert english != german
        assert {int(each) for each in re.findall(r"\{(\d)\}", german)} <= set(
            range(1, english.count("{}") + 1)
        ), english
        parts = [part.strip(" .") for part in re.split(r"\{\}|[:();,]", english)]
        for part in parts:
            assert part in source or ASSEMBLED.search(part), f"nothing says {part!r}: {english}"
    assert len({english for english, _ in phrases}) == len(phrases)


def test_a_phone_s_cameras_are_called_by_the_way_they_look(modules: Page) -> None:
    script = "return m.cameraNames(a)"
    cameras = [
        {"label": "camera2 1, facing front", "facing": "user"},
        {"label": "camera2 0, facing back", "facing": "environment"},
        {"label": "camera2 2, facing back", "facing": "environment"},
        {"label": "HD Webcam", "facing": None},
        {"label": "", "facing": None},
    ]
    names = run(modules, "ui/operator-view.js", script, cameras)
    assert names == ["Front camera", "Rear camera", "Rear camera 2", "HD Webcam", "Camera 5"]


def test_joints_are_called_alike_in_the_pad_and_in_what_the_robot_says(modules: Page) -> None:
    joints = [
        {"name": name, "unit": "rad", "velocity": 1.0} for name in ("joint1", "joint2", "joint3")
    ]
    robot = {"joints": joints, "poses": {"home": []}, "gripper_max": 0, "drives": False}
    script = "return m.movesOf(a, []).joint.map(({ label }) => label)"
    minus = "\N{MINUS SIGN}"
    labels = run(modules, "ui/moves.js", script, robot)
    assert labels == [f"J1 {minus}", "J1 +", f"J2 {minus}", "J2 +", f"J3 {minus}", "J3 +"]
    said = ["joint2 is at its upper limit", "joint 3 would pass its limit"]
    script = "return a.said.map((text) => m.toldOf(text, a.robot))"
    told = run(modules, "ui/words.js", script, {"said": said, "robot": robot})
    assert told == ["J2 is at its upper limit", "J3 would pass its limit"]


def test_no_style_knows_left_from_right() -> None:
    """Who reads from right to left gets the page mirrored."""
    physical = re.compile(
        r"(?<![\w-])(?:(?:margin|padding|border)-(?:left|right)\b|(?:left|right):"
        r"|text-align: (?:left|right)|float:"
        r"|(?:margin|padding|inset): [^\s;]+ [^\s;]+ [^\s;]+ [^\s;]+;)"
    )
    for path in (STATIC / "styles").glob("*.css"):
        # Sums have spaces of their own.
        flat = re.sub(r"\((?:[^()]|\([^()]*\))*\)", "()", path.read_text())
        assert not physical.search(flat), (path.name, physical.search(flat))
    for path in STATIC.rglob("*.js"):
        assert not re.search(r"\.style\.(left|right|marginLeft|marginRight)\b", path.read_text()), (
            path
        )
