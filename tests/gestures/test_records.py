import unicodedata

import pytest

from app.errors import Invalid
from app.gestures.records import MAX_SAMPLES, check_templates, clean_name, name_key
from tests.gestures.conftest import template


@pytest.mark.parametrize(
    "name",
    [
        "up",
        "a/b\\c",
        "../../etc/passwd",
        "<script>alert('x')</script>",
        'it\'s "quoted"; DROP TABLE gesture; --',
        "left \U0001f44b\U0001f3fd",
        "\U0001f468\u200d\U0001f469\u200d\U0001f467",  # a family, joined
        "مرحبا",
        "می\u200cروم",  # Persian needs the non-joiner
        "日本語",
        "%s {0} $x",
        "x" * 60,
    ],
)
def test_names_are_data(name: str) -> None:
    assert clean_name(name) == name


def test_names_are_trimmed_and_composed() -> None:
    decomposed = unicodedata.normalize("NFD", "  Grüße ")
    assert clean_name(decomposed) == "Grüße"


@pytest.mark.parametrize("name", ["", "   ", "\t\n", "\u200d", " \u200c "])
def test_empty_names_are_refused(name: str) -> None:
    with pytest.raises(Invalid):
        clean_name(name)


def test_a_long_name_is_refused_with_its_length() -> None:
    with pytest.raises(Invalid, match="the name has 61 characters; at most 60 are allowed"):
        clean_name("x" * 61)


@pytest.mark.parametrize("sign", ["\n", "\x00", "\x1b", "\u202e", "\ud800", "\ufeff", "\u2028"])
def test_characters_that_cannot_be_printed_are_refused_by_number(sign: str) -> None:
    with pytest.raises(Invalid, match=rf"U\+{ord(sign):04X}, which cannot be printed"):
        clean_name(f"a{sign}b")


@pytest.mark.parametrize(
    ("a", "b"), [("Up", "uP"), ("STRASSE", "straße"), ("É", "e\u0301"), ("ΣΑΣ", "σας")]
)
def test_names_that_differ_only_in_case_have_one_key(a: str, b: str) -> None:
    assert name_key(clean_name(a)) == name_key(clean_name(b))


def test_different_names_have_different_keys() -> None:
    assert name_key("up") != name_key("down")


def test_good_templates_come_back_as_a_tuple() -> None:
    assert check_templates([template(1), bytearray(template(2))]) == (template(1), template(2))


@pytest.mark.parametrize(
    ("templates", "message"),
    [
        ([], "a gesture needs at least one picture"),
        ([template(), b"x"], "template 2 has 1 bytes; 60x80 pixels, one bit each, are 600"),
        ([bytes(600)], "template 1 is one colour all over; it shows no hand"),
        ([b"\xff" * 600], "template 1 is one colour all over; it shows no hand"),
        ([template()] * (MAX_SAMPLES + 1), "1001 samples given; a gesture may have 1000"),
    ],
)
def test_bad_templates_are_refused(templates: list[bytes], message: str) -> None:
    with pytest.raises(Invalid) as caught:
        check_templates(templates)
    assert caught.value.message == message
