"""The tour and the README show pictures that are there, small, and all of them."""

import re
from pathlib import Path

import pytest

from docs.make_pictures import SCENES

ROOT = Path(__file__).parents[1]
DOCS = {path.name: path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))}
IMAGE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
LINK = re.compile(r"(?<!!)\[[^\]]+\]\(([^)#\s]+)[^)]*\)")


def pictures_of(path: Path) -> list[Path]:
    return [path.parent / target for _, target in IMAGE.findall(path.read_text())]


@pytest.mark.parametrize("name", DOCS)
def test_what_is_shown_and_linked_is_there(name: str) -> None:
    path = DOCS[name]
    text = path.read_text()
    assert all(words for words, _ in IMAGE.findall(text)), "a picture without words"
    targets = [target for target in LINK.findall(text) if "://" not in target]
    for target in [*targets, *(target for _, target in IMAGE.findall(text))]:
        assert (path.parent / target).exists(), target


def test_the_tour_is_light_and_shows_every_scene() -> None:
    tour = pictures_of(DOCS["tour.md"])
    assert len(tour) == len(SCENES)
    assert sum(picture.stat().st_size for picture in tour) < 600_000


def test_no_picture_is_left_over() -> None:
    shown = {picture.name for path in DOCS.values() for picture in pictures_of(path)}
    assert {picture.name for picture in (ROOT / "docs" / "pictures").iterdir()} == shown
