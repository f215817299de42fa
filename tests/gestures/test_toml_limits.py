"""TOML is simple enough or refused, in time that grows with its length alone."""

import tomllib
from pathlib import Path

import pytest

from app.errors import Invalid
from app.gestures.toml_limits import MAX_DEPTH, MAX_LINE, MAX_PARTS, check_simple


def test_what_the_product_writes_is_simple() -> None:
    check_simple((Path(__file__).parents[2] / "gesture_db" / "gestures.toml").read_text())


@pytest.mark.parametrize(
    "text",
    [
        'a = "x.y.z.1.2.3.4.5.6.7.8.9.[[[[[[{{{{"',
        "a = '''\n...........\n[[[[ ' ''\n'''",
        'a = """\n........... \\""" [[[ "" \n"""',
        "# .......... [[[[[[[[[[[[[[ \" '",
        "a = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1]",
        "\n".join(f"[a{n}.b.c]\nd.e = 1.5" for n in range(50)),
        "a = " + "[" * MAX_DEPTH + "]" * MAX_DEPTH,
        ".".join("a" * MAX_PARTS) + " = 1",
        "",
    ],
)
def test_what_is_simple_is_let_through_and_is_toml(text: str) -> None:
    check_simple(text)
    tomllib.loads(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a." * 40_000 + "a = 1", f"a key of more than {MAX_PARTS} parts in line 1"),
        ("x = 1\n[" + "a . " * 20_000 + "a]", f"a key of more than {MAX_PARTS} parts in line 2"),
        ('"a"." b".\'c\'' + ".d" * 9 + " = 1", "a key of more than"),
        ("a = {" + "b." * 20 + "b = 1}", "a key of more than"),
        ("a = " + "[" * 40_000, f"brackets nested deeper than {MAX_DEPTH} in line 1"),
        ("a = " + "{b = " * 20_000, "brackets nested deeper"),
        ("#" * (MAX_LINE + 1), f"a line of {MAX_LINE + 1} characters"),
        ('a = "x\nb = 1', "a string without an end in line 1"),
        ("a = '''x\nb = 1", "a string without an end in line 1"),
        ('a = 1\nb = """' + '\\"""' * 20_000, "a string without an end in line 2"),
        ("a = '''" + "''x" * 5, "a string without an end"),
    ],
)
def test_what_is_not_is_refused_with_the_place(text: str, message: str) -> None:
    with pytest.raises(Invalid, match=r"^has ") as caught:
        check_simple(text)
    assert message in caught.value.message
