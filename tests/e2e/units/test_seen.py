"""What was seen in a picture that teaches: drawn, in words, and tried at once."""

from typing import Any

import pytest
from playwright.sync_api import Page

from app.gateway.signs import compare
from app.gestures.hand.poses import POSES, stretched
from tests.e2e.running import run

pytestmark = pytest.mark.e2e

POINTS = [[100 + 10 * n, 200] for n in range(21)]
FINGERS = {"thumb": None, "index": True, "middle": False, "ring": False, "little": True}
SEEN: dict[str, Any] = {
    "size": [640, 480],
    "landmarks": POINTS,
    "handedness": {"hand": "right", "right": 0.99},
    "fingers": FINGERS,
    "mask_agrees": True,
    "region": [100, 100, 200, 240],
}
GOOD = {"accepted": True, "problem": None, "reason": None, "advice": [], "sign": None, "seen": SEEN}


def words(page: Page, script: str, given: Any = None) -> Any:
    """With the functions of ui/seen.js."""
    return run(page, "ui/seen.js", script, given)


def test_landmarks_are_drawn_where_the_picture_is(modules: Page) -> None:
    script = (
        "return [m.BONES, m.pointsIn(a, 144, 108), m.pointsIn(a, 144, 200), m.pointsIn(null, 9, 9)]"
    )
    bones, points, lower, none = run(modules, "ui/landmarks.js", script, SEEN)
    assert len(bones) == 20
    assert bones[0] == [0, 1] and bones[4] == [0, 5] and bones[7] == [7, 8]
    assert points[0] == pytest.approx([22.5, 45])
    assert lower[0] == pytest.approx([22.5, 45 + 46])
    assert none is None


def test_a_picture_with_its_hand_is_drawn(modules: Page) -> None:
    script = """
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [144, 108];
    const source = new OffscreenCanvas(640, 480);
    source.getContext("2d").fillRect(0, 0, 640, 480);
    const bitmap = await createImageBitmap(source);
    const lit = () => {
        const { data } = canvas.getContext("2d").getImageData(0, 40, 144, 10);
        return data.filter((value, index) => index % 4 < 3 && value > 60).length;
    };
    m.drawTake(canvas, bitmap);
    const before = lit();
    document.documentElement.style.setProperty("--overlay-found", "#fff");
    m.drawTake(canvas, bitmap, a);
    return [before, lit()];
    """
    before, after = run(modules, "ui/seen.js", script, SEEN)
    assert before == 0
    assert after > 100


def test_a_picture_is_told_to_who_does_not_see_it(modules: Page) -> None:
    nothing = {**SEEN, "landmarks": None, "handedness": None, "fingers": None}
    mended = {**SEEN, "mask_agrees": False, "handedness": {"hand": None, "right": 0.5}}
    said = words(modules, "return a.map(m.seenWords)", [SEEN, nothing, mended, None])
    none = "No hand's joints are seen in it."
    assert said == [
        "Seen: a right hand. Stretched: index finger, little finger.",
        none,
        "Seen: a hand. Stretched: index finger, little finger. "
        "Its outline is taken from its joints.",
        none,
    ]


def test_each_take_has_its_verdict(modules: Page) -> None:
    up = stretched(POSES["up"])
    shown = (("close", "palm_only"), ("forward", "count"), ("right", "fingers"))
    signs = []
    for name, code in shown:
        found = compare(stretched(POSES[name]), up)
        assert found is not None and found.code == code
        signs.append(found.as_json())
    unlike = [{**GOOD, "accepted": False, "sign": sign} for sign in signs]
    soft = {**GOOD, "advice": [{"code": "soft", "message": "more light would help"}]}
    bad = {**GOOD, "accepted": False, "problem": "no_hand", "reason": "no hand found"}
    script = "return [...a.images.map((i) => m.takeVerdict(i)), m.takeVerdict(a.good, 'left')]"
    said = words(modules, script, {"images": [GOOD, soft, bad, *unlike], "good": GOOD})
    assert [one["state"] for one in said] == ["good", "good", "bad", *["unlike"] * 3, "good"]
    assert [one["text"] for one in said] == [
        "hand found",
        "hand found; more light would help",
        "no hand found",
        "Only your palm is seen: one finger is asked.",
        "That is two fingers: one finger is asked.",
        "Other fingers are asked. Stretch: index finger. Bend: little finger.",
        "hand found; looks like “left”",
    ]


LIVE = """
const store = { state: { source: { state: "none" }, connection: { state: "open" }, robot: null } };
let asked = 0;
const gesture = { name: "wave", action: { type: "stop" } };
const addPhoto = () => { asked += 1; };
const { content, close } = m.tryContent({ gesture, store, video: {}, addPhoto, done() {} });
document.body.replaceChildren(...content);
const part = (css) => document.querySelector(css);
const show = async (name, ms) => {
    const match = name ? { gesture: name } : null;
    const frame = { match, reason: name ? null : "the hand moves" };
    for (const end = performance.now() + ms; performance.now() < end; ) {
        Object.assign(store.state, { frame, frameAt: performance.now() });
        await new Promise((go) => setTimeout(go, 30));
    }
    return [part(".try-live").textContent, part(".try-line").dataset.held];
};
const until = async (name, held) => {
    for (let tries = 0; tries < 100; tries += 1) {
        const said = await show(name, 300);
        if (said[1] === held) return said;
    }
    return null;
};
"""


def test_a_new_gesture_is_tried_at_once(modules: Page) -> None:
    script = """
    const seen = [await show(null, 300), await show("up", 300), await until("wave", "true")];
    part("#try-add").click();
    const told = part(".try-verdict").textContent;
    const all = document.body.textContent;
    close();
    document.body.replaceChildren();
    return { seen, told, all, asked };
    """
    found = run(modules, "ui/try-now.js", LIVE + script)
    assert found["seen"] == [
        ["the hand moves", "false"],
        ["seen as “up”", "false"],
        ["“wave”", "true"],
    ]
    assert found["told"] == "“wave” is known."
    assert "This one really stops the robot." in found["all"]
    assert found["asked"] == 1


def test_who_drives_is_told_that_the_new_gesture_moves_the_arm(modules: Page) -> None:
    script = """
    const robot = { controller: "me", armed: true };
    Object.assign(store.state, { hello: { session: "me" }, robot });
    await show("wave", 300);
    const said = document.body.textContent;
    close();
    document.body.replaceChildren();
    return said;
    """
    assert "You drive: this gesture moves the arm." in run(modules, "ui/try-now.js", LIVE + script)
