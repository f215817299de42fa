"""Anyone's profile, and what is said of a wrong one: the file, the line and what would be right."""

import re
from pathlib import Path

import pytest

from app.errors import CannotStart
from app.robot.models import model_assets, model_names
from tests.robot.models.profiles import TOML, URDF, write_profile


def line_with(text: str, part: str, number: int = 1) -> int:
    """The line of the ``number``-th place where ``part`` stands."""
    found = [at for at, line in enumerate(text.splitlines(), start=1) if part in line]
    return found[number - 1]


def test_what_comes_with_farhand() -> None:
    assert model_names() == ["franka_panda", "husky", "kuka_iiwa", "puma560"]


def test_a_robot_of_ones_own_is_read_from_any_folder(tmp_path: Path) -> None:
    path = write_profile(tmp_path / "my robot")
    assets = model_assets(str(path))
    assert assets.name == "mine"
    description = assets.describe("r1")
    assert (description.id, description.name, description.model) == ("r1", "Mine", "mine")
    assert [joint.unit for joint in description.joints] == ["rad", "m"]
    assert description.gripper_max == 0.06
    copied = {file.name for file in assets.urdf_path.parent.rglob("block.*")}
    assert copied == {"block.stl", "block.obj", "block.mtl"}
    assert "package://" not in assets.urdf_path.read_text()


def test_a_robot_without_a_gripper_says_so(tmp_path: Path) -> None:
    toml = re.sub(r"(?s)\[gripper\].*?\n\n", "", TOML)
    assets = model_assets(str(write_profile(tmp_path / "a", toml)))
    assert assets.describe("r").gripper_max == 0.0


def test_links_without_a_mass_weigh_next_to_nothing(tmp_path: Path) -> None:
    assets = model_assets(str(write_profile(tmp_path / "a")))
    assert '<link name="tip"><inertial><mass value="0.001" />' in assets.urdf_path.read_text()


def replaced(old: str, new: str) -> str:
    assert TOML.count(old) >= 1
    return TOML.replace(old, new, 1)


WRONG = [
    # name, profile, the line's text (and which of several), what is said
    (
        "key",
        replaced('home = "home"', 'home = "home"\ncolour = 3'),
        "colour = 3",
        "unknown key colour",
    ),
    (
        "near key",
        replaced("velocity = 1.0", "velocitty = 1.0"),
        "velocitty",
        r"unknown key joints\[1\].velocitty; did you mean velocity\?",
    ),
    (
        "key in a camera",
        replaced("near = 0.1", "near = 0.1\nzoom = 2"),
        "zoom",
        r"unknown key cameras\[1\].zoom",
    ),
    (
        "missing key",
        replaced("velocity = 0.3\n", ""),
        "[[joints]]#2",
        r"the key joints\[2\].velocity is missing",
    ),
    (
        "type",
        replaced("width = 0.06", 'width = "wide"'),
        'width = "wide"',
        "gripper.width: .*'wide'",
    ),
    ("not TOML", replaced("jerk = 130.0", "jerk = "), "jerk = ", "this is not TOML"),
    ("not finite", replaced("jerk = 130.0", "jerk = inf"), "jerk = inf", "finite"),
    (
        "limits upside down",
        replaced("lower = -1.9", "lower = 1.95"),
        "lower = 1.95",
        "turn: lower 1.95 is not below upper 1.9",
    ),
    (
        "beyond the URDF",
        replaced("upper = 1.9", "upper = 2.5"),
        "upper = 2.5",
        "turn: upper 2.5 is beyond the URDF's 2.0",
    ),
    (
        "faster than the URDF",
        replaced("velocity = 1.0", "velocity = 3.0"),
        "velocity = 3.0",
        "turn: velocity 3.0 is beyond the URDF's 2.0",
    ),
    (
        "joint not there",
        replaced('name = "slide"', 'name = "slides"'),
        'name = "slides"',
        "there is no joint 'slides' in the URDF; it has: end, one, other, slide, turn",
    ),
    (
        "joint fixed",
        replaced('name = "slide"', 'name = "end"'),
        'name = "end"',
        "the joint end is fixed in the URDF",
    ),
    (
        "joint twice",
        replaced('name = "slide"', 'name = "turn"'),
        'name = "turn"#2',
        "joints: the same name twice, turn",
    ),
    (
        "joint of a finger",
        replaced(
            'name = "slide"\nlower = 0.0\nupper = 0.4', 'name = "one"\nlower = 0.0\nupper = 0.03'
        )
        .replace("[0.0, 0.1]", "[0.0, 0.0]")
        .replace("  0.3,\n", "  0.02,\n"),
        "[[joints]]#2",
        "between base and tip move, in this order: turn, slide; the joints given are: turn, one",
    ),
    ("pose outside", replaced("  0.5,", "  1.95,"), "out = [", "pose out: turn at 1.95 .* outside"),
    ("pose too short", replaced("[0.0, 0.1]", "[0.0]"), "home = [", "pose home: 1 numbers for 2"),
    ("no such home", replaced('home = "home"', 'home = "bed"'), 'home = "bed"', "no pose bed"),
    (
        "camera link",
        replaced('link = "base"', 'link = "bass"'),
        'link = "bass"',
        "there is no link 'bass' in the URDF; it has: base, left, lower, right, tip, upper",
    ),
    (
        "camera shows",
        replaced("far = 5.0", 'far = 5.0\nshows = ["base", "nose"]'),
        "shows",
        "there is no link 'nose'",
    ),
    ("tool link", replaced('"tip"', '"top"'), "tool_link", "there is no link 'top'"),
    ("base link", replaced('base_link = "base"', 'base_link = "no"'), "base_link", "no link 'no'"),
    (
        "no chain",
        replaced('"base"', '"left"'),
        "tool_link",
        "no joints lead from the link left to the link tip",
    ),
    (
        "fingers",
        replaced('["one", "other"]', '["one", "thumb"]'),
        "fingers",
        "gripper.fingers: there is no joint 'thumb'",
    ),
    (
        "finger that turns",
        replaced('["one", "other"]', '["one", "turn"]'),
        "fingers",
        "turn is revolute, and has to slide",
    ),
    (
        "too wide",
        replaced("width = 0.06", "width = 0.08"),
        "width = 0.08",
        "gripper.width: 0.08 m needs 0.04 m of each finger, and one slides to 0.03 m",
    ),
    (
        "never touch",
        replaced('home = "home"', 'home = "home"\nnever_touch = [["base", "x"]]'),
        "never_touch",
        "there is no link 'x'",
    ),
    ("URDF not there", replaced("mine.urdf", "no.urdf"), "urdf = ", "there is no file .*no.urdf"),
    (
        "URDF of no package",
        replaced("mine.urdf", "package://nobody/x.urdf"),
        "urdf = ",
        "the Python package nobody has no file x.urdf, or is not installed",
    ),
    (
        "attached to nothing",
        TOML + '\n[[attach]]\nurdf = "mine.urdf"\nto = "nowhere"\n',
        'to = "nowhere"',
        "there is no link 'nowhere'",
    ),
    (
        "attached twice",
        TOML + '\n[[attach]]\nurdf = "mine.urdf"\nto = "tip"\n',
        'urdf = "mine.urdf"#2',
        "mine.urdf has a link 'base', as the robot has",
    ),
    (
        "a base with an arm's joints",
        TOML + '\n[base]\nleft = ["one"]\nright = ["other"]\nradius = 0.1\ntrack = 0.5\n',
        "[gripper]",
        "a robot that drives has no gripper yet",
    ),
]


@pytest.mark.parametrize(
    ("toml", "place", "said"), [w[1:] for w in WRONG], ids=[w[0] for w in WRONG]
)
def test_a_wrong_profile_is_told_with_its_line(
    tmp_path: Path, toml: str, place: str, said: str
) -> None:
    path = write_profile(tmp_path / "a", toml)
    text, _, number = place.partition("#")
    line = line_with(toml, text, int(number or 1))
    with pytest.raises(CannotStart) as error:
        model_assets(str(path))
    assert error.value.message.startswith(f"{path}:{line}: "), error.value.message
    assert re.search(said, error.value.message), error.value.message
    assert "\n" not in error.value.message


WRONG_URDF = [
    ("not XML", URDF.replace("</robot>", "</robt>"), "is not XML: .*line"),
    ("not a URDF", "<sdf/>", "begins with <sdf>"),
    ("xacro", URDF.replace('xyz="0 0 0.2"', 'xyz="0 0 ${height}"'), r"still a xacro file \(line"),
    ("no child", URDF.replace('<child link="upper"/>', ""), "joint turn needs a type"),
    ("child not there", URDF.replace('<child link="upper"/>', '<child link="x"/>'), "link 'x'"),
    ("limit", URDF.replace('upper="2"', 'upper="two"'), "joint turn: upper is 'two', not a number"),
    ("two trees", URDF.replace("</robot>", '<link name="alone"/></robot>'), "hang on no joint"),
    (
        "mesh not there",
        URDF.replace("meshes/block.obj", "meshes/lost.obj"),
        r"mine.urdf:\d+ names a mesh 'meshes/lost.obj' that is not there",
    ),
    (
        "mesh of another kind",
        URDF.replace("meshes/block.obj", "mine.toml"),
        r"names a mesh 'mine.toml' of a kind that cannot be read; there are: .stl, .obj, .dae",
    ),
]


@pytest.mark.parametrize(
    ("urdf", "said"), [w[1:] for w in WRONG_URDF], ids=[w[0] for w in WRONG_URDF]
)
def test_a_wrong_urdf_is_told_with_the_profiles_line(tmp_path: Path, urdf: str, said: str) -> None:
    path = write_profile(tmp_path / "a", urdf=urdf)
    with pytest.raises(CannotStart) as error:
        model_assets(str(path))
    assert error.value.message.startswith(f"{path}:2: "), error.value.message
    assert re.search(said, error.value.message), error.value.message


def test_a_profile_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match=r"the robot profile .*/no.toml cannot be read: No such"):
        model_assets(str(tmp_path / "no.toml"))


def test_several_faults_are_counted_and_the_first_is_told(tmp_path: Path) -> None:
    toml = TOML.replace("near = 0.1", "near = -1").replace("width = 0.06", "width = -1")
    with pytest.raises(CannotStart, match=r"gripper.width: .*\(and 1 more\)$"):
        model_assets(str(write_profile(tmp_path / "a", toml)))
