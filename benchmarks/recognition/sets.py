"""The photographs of one set, and which room or person each belongs to."""

import re
from pathlib import Path
from typing import NamedTuple

from app.pipeline.evaluate import find_images
from app.pipeline.trials import groups_of

ROOM = "^[^-]+"
"""webcam-box and webcam-full: the room is what stands before the first dash."""


class PhotoSet(NamedTuple):
    """One set; the three lists run side by side.

    Attributes:
        name: The folder's.
        paths: Of the photographs.
        labels: Their folders.
        groups: Room or person of each; None when nothing is known.
    """

    name: str
    paths: list[Path]
    labels: list[str]
    groups: list[str] | None


def read_set(directory: Path, group: str | None, every: int = 1, held: bool = False) -> PhotoSet:
    """Read the photographs in ``directory/LABEL/``.

    Args:
        directory: Where they are.
        group: Regular expression for the group, see :func:`~app.pipeline.trials.groups_of`; None
            for what is known of the sets in ``shared/data``.
        every: Take one of so many photographs of each label.
        held: Only those that the training of the mask network keeps aside.
    """
    images = find_images(directory)
    if held:
        from training.photos import is_held

        images = {k: [path for path in v if is_held(path, v)] for k, v in images.items()}
    listed = [(label, path) for label, paths in images.items() for path in paths[::every]]
    labels, paths = [label for label, _ in listed], [path for _, path in listed]
    groups: list[str] | None = None
    if group is not None:
        groups = groups_of(paths, group)
    elif directory.name.startswith("webcam-"):
        groups = groups_of(paths, ROOM)
    elif directory.name == "digits":
        groups = people(paths, labels)
    return PhotoSet(directory.name, paths, labels, groups)


def people(paths: list[Path], labels: list[str]) -> list[str]:
    """Who shows the digit signs: each person was photographed from 0 to 9, one after the other.

    So in the order of the files' numbers a new person begins where the digit does not rise. A
    person of whom photographs are missing may be split in two, never joined to another of whom
    the sign before was kept.
    """
    number = [int(re.sub(r"\D", "", path.stem) or 0) for path in paths]
    groups = [""] * len(paths)
    person, last = 0, ""
    for i in sorted(range(len(paths)), key=lambda i: number[i]):
        person += labels[i] <= last
        last = labels[i]
        groups[i] = f"person {person}"
    return groups
