import contextlib
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import Invalid
from app.gestures import NewGesture, read_set, template_png, write_set
from app.link.actions import Gripper, Home, JogCartesian, JogJoint, Pose, Sequence, Stop, TurnJoint
from tests.gestures.conftest import STARTER, template

GESTURES = [
    NewGesture("forward", JogCartesian(linear=(0.1, 0.0, 0.0)), (template(1), template(2))),
    NewGesture("../../x", JogCartesian(frame="tool", angular=(0, 1e-05, 0)), (template(3),)),
    NewGesture('"quotes" \\ and <b>', TurnJoint(joint=2, angle=-0.5), (template(4),)),
    NewGesture("مرحبا", Pose(name="ready"), (template(5),)),
    NewGesture("\U0001f44b", Gripper(width=0.05), (template(6),)),
    NewGesture("Forward!", Home(), (template(7),)),
    NewGesture(
        "twice",
        Sequence(steps=(JogJoint(joint=1, velocity=0.1, duration=2.0), Home(), Stop())),
        (template(8),) * 120,
    ),
]


@pytest.mark.parametrize("name", ["set", "set.zip"])
def test_a_set_comes_back_as_it_was(tmp_path: Path, name: str) -> None:
    write_set(GESTURES, tmp_path / name)
    assert read_set(tmp_path / name) == GESTURES


def test_equal_sets_are_equal_to_the_byte(tmp_path: Path) -> None:
    write_set(GESTURES, tmp_path / "a.zip")
    write_set(read_set(tmp_path / "a.zip"), tmp_path / "b.zip")
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()


def test_an_empty_set_is_a_set(tmp_path: Path) -> None:
    write_set([], tmp_path / "set")
    assert read_set(tmp_path / "set") == []


def test_file_names_are_plain_and_stay_inside(tmp_path: Path) -> None:
    write_set(GESTURES, tmp_path / "set")
    names = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.png")}
    assert "set/forward/01.png" in names
    assert "set/forward-2/01.png" in names
    assert "set/x/01.png" in names
    assert "set/gesture/01.png" in names
    assert "set/gesture-2/01.png" in names
    assert "set/twice/001.png" in names
    assert all(name.isascii() for name in names)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["set"]


def test_an_empty_folder_is_filled_and_nothing_is_overwritten(tmp_path: Path) -> None:
    target = tmp_path / "set"
    target.mkdir()
    write_set(GESTURES, target)
    for existing in (target, target / "gestures.toml"):
        with pytest.raises(Invalid, match="exists already; name a new folder or zip file"):
            write_set(GESTURES, existing)
    with pytest.raises(Invalid, match="does not exist; make it first"):
        write_set(GESTURES, tmp_path / "no" / "set")


def test_a_set_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(Invalid, match="a template has 600 bytes"):
        write_set([NewGesture("x", Home(), (b"short",))], tmp_path / "set")
    assert list(tmp_path.iterdir()) == []


def test_a_zip_packed_as_a_folder_is_read(tmp_path: Path) -> None:
    write_set(GESTURES, tmp_path / "set")
    with zipfile.ZipFile(tmp_path / "s.zip", "w") as archive:
        for path in (tmp_path / "set").rglob("*"):
            archive.write(path, path.relative_to(tmp_path).as_posix())
    assert read_set(tmp_path / "s.zip") == GESTURES


GOOD = """format = 1
[[gesture]]
name = "a"
action = { type = "home" }
samples = ["a/01.png"]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Callable[[str], Path]:
    """Makes a set from the text of its index; one sample is there."""

    def make(index: str) -> Path:
        target = tmp_path / "set"
        (target / "a").mkdir(parents=True, exist_ok=True)
        (target / "a" / "01.png").write_bytes(template_png(template()))
        (target / "gestures.toml").write_bytes(index.encode("utf-8", "surrogateescape"))
        return target

    return make


def refusal(source: Path) -> str:
    with pytest.raises(Invalid) as caught:
        read_set(source)
    assert "\n" not in caught.value.message
    return caught.value.message


def test_the_example_is_read(folder: Callable[[str], Path]) -> None:
    assert read_set(folder(GOOD)) == [NewGesture("a", Home(), (template(),))]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "format = 1",
            "format = 3",
            "gestures.toml has format 3; this Farhand reads formats 1 and 2",
        ),
        ("format = 1", "", "gestures.toml has format None; this Farhand reads formats 1 and 2"),
        ("format = 1", "format = true", "has format True; this Farhand reads formats 1 and 2"),
        ("format = 1", "format = 1\nx = 2", "gestures.toml: unknown key 'x'; allowed are"),
        ("[[gesture]]", "[gesture]", "gestures are written as [[gesture]], with two brackets"),
        ('name = "a"', "", "gesture 1: name is missing, or is not a text"),
        ('name = "a"', "name = 3", "gesture 1: name is missing, or is not a text"),
        ('name = "a"', 'name = ""', "gesture 1: a gesture needs a name: 1 to 60 characters"),
        ('name = "a"', 'name = "a\\nb"', "U+000A, which cannot be printed"),
        ('name = "a"', 'name = "a"\nnote = 1', "gesture 1 (a): unknown key 'note'"),
        ('["a/01.png"]', "[]", "gesture 1 (a): a gesture needs at least one picture"),
        ('["a/01.png"]', '"a/01.png"', "samples is missing, or is not a list of paths"),
        ("a/01.png", "a/02.png", "gesture 1 (a): sample 'a/02.png' is missing in"),
        ("a/01.png", "../../x.png", "sample '../../x.png' is not a plain path below the set's"),
        ("a/01.png", "/etc/passwd", "sample '/etc/passwd' is not a plain path below"),
        ("a/01.png", "a/./01.png", "is not a plain path"),
        ("a/01.png", "a\\\\01.png", "is not a plain path"),
        ("a/01.png", "C:/01.png", "is not a plain path"),
        ("a/01.png", "", "is not a plain path"),
        ("a/01.png", "a\\u0000", "is not a plain path"),
        ("a/01.png", "a", "is missing in"),
        ("a/01.png", "a" * 5000, "neither a readable folder nor"),
        ("a/01.png", "gestures.toml", "sample 'gestures.toml' is not a PNG file"),
        ('"home"', '"hme"', "gesture 1 (a): bad action: "),
        ('type = "home"', 'type = "home", x = 1', "bad action: home.x: Extra inputs"),
        ('type = "home"', 'type = "gripper", width = nan', "bad action: "),
        ('type = "home"', 'type = "gripper", width = "0.1"', "bad action: gripper.width"),
        ('type = "home"', 'type = "gripper", width = 7', "bad action: gripper.width"),
        ('type = "home"', "type = 1979-05-27", "bad action: "),
        ('{ type = "home" }', "3", "bad action: "),
        ('action = { type = "home" }', "", "bad action: "),
        ("format", "format = = 1", "gestures.toml is not TOML in UTF-8: "),
        ("format", "\udcff", "gestures.toml is not TOML in UTF-8: "),
        ("format = 1", "format = 1\ny = " + "[" * 5000, "brackets nested deeper than 32 in line 2"),
        ("format = 1", "format = 1\n" + "a." * 40_000 + "a = 1", "more than 8 parts in line 2"),
        ("format = 1", "format = 1\n" + "#" * (1 << 20), "is larger than 1048576 bytes"),
    ],
)
def test_what_is_wrong_is_said(
    folder: Callable[[str], Path], old: str, new: str, message: str
) -> None:
    assert message in refusal(folder(GOOD.replace(old, new, 1)))


def test_a_name_may_come_only_once(folder: Callable[[str], Path]) -> None:
    second = GOOD.replace("format = 1", "").replace('"a"', '"A"')
    assert "gesture 2: the name 'A' is taken by 'a'" in refusal(folder(GOOD + second))


def test_links_out_of_the_folder_are_not_followed(
    folder: Callable[[str], Path], tmp_path: Path
) -> None:
    (tmp_path / "outside.png").write_bytes(template_png(template()))
    target = folder(GOOD.replace("a/01.png", "a/02.png"))
    (target / "a" / "02.png").symlink_to(tmp_path / "outside.png")
    assert "sample 'a/02.png' leads out of the set's folder" in refusal(target)


def test_missing_sources_say_what_would_be_right(tmp_path: Path) -> None:
    assert "does not exist; name a folder with gestures.toml in it" in refusal(tmp_path / "no")
    assert "gestures.toml is missing in" in refusal(tmp_path)
    (tmp_path / "x.zip").write_bytes(b"nonsense")
    assert "neither a readable folder nor a readable zip file" in refusal(tmp_path / "x.zip")
    with zipfile.ZipFile(tmp_path / "y.zip", "w") as archive:
        archive.writestr("readme.txt", "nothing")
    assert "gestures.toml is missing in the zip file" in refusal(tmp_path / "y.zip")


def test_a_zip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gestures.toml", GOOD)
        archive.writestr("a/01.png", bytes(100 << 20))
    assert "sample 'a/01.png' is larger than 16384 bytes" in refusal(tmp_path / "x.zip")


def test_a_zip_that_lies_about_its_sizes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gestures.toml", GOOD)
        archive.writestr("a/01.png", bytes(1 << 20))
    real = struct.pack("<I", 1 << 20)
    path.write_bytes(path.read_bytes().replace(real, struct.pack("<I", 300)))
    refusal(path)


def test_a_zip_with_a_password_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    write_set(GESTURES, path)
    data = bytearray(path.read_bytes())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        start = data.find(mark)
        while start >= 0:
            data[start + place] |= 1
            start = data.find(mark, start + 4)
    path.write_bytes(data)
    assert "gestures.toml is encrypted; pack the set without a password" in refusal(path)


STARTER_INDEX = (STARTER / "gestures.toml").read_text()


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_indexes_are_read_or_refused_but_never_crash(
    data: st.DataObject, tmp_path: Path
) -> None:
    target = tmp_path / "fuzz"
    if not target.exists():
        target.mkdir()
        for path in STARTER.iterdir():
            if path.is_dir():
                (target / path.name).symlink_to(path)
    text = STARTER_INDEX
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 12))
        text = text[:place] + data.draw(st.text(max_size=8)) + text[place + cut :]
    (target / "gestures.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
    with contextlib.suppress(Invalid):
        read_set(target)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_damaged_zips_are_read_or_refused_but_never_crash(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("zip") / "x.zip"
    write_set(GESTURES[:3], path)
    raw = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(raw)
    with contextlib.suppress(Invalid):
        read_set(path)


def test_landmarks_go_out_and_come_back_in_format_2(tmp_path: Path) -> None:
    hand = bytes((1, 200, *range(252)))
    entry = NewGesture("wave", Home(), (template(1), template(2)), True, (None, hand))
    plain = NewGesture("other", Home(), (template(3),))
    write_set([entry, plain], tmp_path / "set")
    assert "format = 2" in (tmp_path / "set" / "gestures.toml").read_text()
    assert read_set(tmp_path / "set") == [entry, plain]
    write_set([plain], tmp_path / "old")
    assert "format = 1" in (tmp_path / "old" / "gestures.toml").read_text()
    (tmp_path / "set" / "wave" / "02.hand").write_bytes(hand[:-1])
    with pytest.raises(Invalid, match="landmarks 2 have 253 bytes"):
        read_set(tmp_path / "set")
