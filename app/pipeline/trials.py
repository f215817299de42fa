"""Trials: which photographs are enrolled and which are asked about, drawn at random.

A split at random within one room, or within one person's photographs, flatters: the asked ones have
near twins among the enrolled. With groups, half of them (rooms, or people) lend what is enrolled
and the other half what is asked, so that no asked photograph shares its group with an enrolled one.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.errors import Invalid

ATTEMPTS = 1000
"""Random halves of the groups that are tried until one has enough photographs of each label."""


class Trial(NamedTuple):
    """One random choice; photographs are indices.

    Attributes:
        order: Label to the photographs that may be enrolled, in random order.
        asked: Photographs of the enrolled labels that may be asked about. Without groups these are
            all of them, and what is enrolled has to be left out.
        strangers: Photographs of the labels left out.
        closed: Groups of which nothing may be asked about; empty without groups.
    """

    order: dict[str, list[int]]
    asked: list[int]
    strangers: list[int]
    closed: frozenset[str]

    def enrol(self, shots: int, usable: Sequence[bool]) -> dict[str, list[int]]:
        """The first ``shots`` of each label; the usable ones come first."""
        return {
            label: sorted(order, key=lambda i: not usable[i])[:shots]
            for label, order in self.order.items()
        }


def groups_of(paths: Iterable[Path], pattern: str) -> list[str]:
    """The group of each photograph: what ``pattern`` finds in the file's name.

    Args:
        paths: Of the photographs.
        pattern: Regular expression, searched; its first bracket when it has one, such as
            ``^([^-]+)-`` for what comes before the first dash.

    Raises:
        Invalid: not a regular expression, or a name in which it finds nothing.
    """
    try:
        compiled = re.compile(pattern)
    except re.error as error:
        raise Invalid(f"group {pattern!r} is not a regular expression: {error}") from error
    groups = []
    for path in paths:
        found = compiled.search(path.name)
        group = None if found is None else found[1 if compiled.groups else 0]
        if not group:
            raise Invalid(f"group {pattern!r} finds nothing in the file name {path.name}")
        groups.append(group)
    return groups


def draw_trial(
    labels: Sequence[str],
    groups: Sequence[str] | None,
    shots: int,
    left_out: int,
    rng: np.random.Generator,
) -> Trial:
    """Draw one trial.

    Args:
        labels: Of each photograph.
        groups: Of each photograph; None for no groups.
        shots: Photographs a label that will be enrolled.
        left_out: Number of labels that are not enrolled; their photographs are the strangers.
        rng: Where chance comes from.

    Raises:
        Invalid: no half of the groups was found that has ``shots`` photographs of every label,
            while the other half has at least one.
    """
    names = list(dict.fromkeys(labels))
    away = {names[i] for i in rng.choice(len(names), left_out, replace=False)} if left_out else ()
    known = [name for name in names if name not in away]
    by_label = {name: [i for i, label in enumerate(labels) if label == name] for name in known}
    closed = frozenset[str]()
    if groups is not None:
        closed = _half(by_label, groups, shots, rng)
        lend = {label: [i for i in mine if groups[i] in closed] for label, mine in by_label.items()}
    else:
        lend = by_label
    order = {label: [mine[k] for k in rng.permutation(len(mine))] for label, mine in lend.items()}
    may_ask = [i for i in range(len(labels)) if groups is None or groups[i] not in closed]
    return Trial(
        order,
        [i for i in may_ask if labels[i] not in away],
        [i for i in may_ask if labels[i] in away],
        closed,
    )


def _half(
    by_label: Mapping[str, list[int]],
    groups: Sequence[str],
    shots: int,
    rng: np.random.Generator,
) -> frozenset[str]:
    """Half of the groups, such that both sides have enough of every label."""
    names = sorted(set(groups))
    for _ in range(ATTEMPTS if len(names) > 1 else 0):
        size = (len(names) + int(rng.integers(2))) // 2
        half = frozenset(names[i] for i in rng.permutation(len(names))[:size])
        inside = (sum(groups[i] in half for i in mine) for mine in by_label.values())
        if all(
            shots <= count < len(mine)
            for count, mine in zip(inside, by_label.values(), strict=True)
        ):
            return half
    raise Invalid(
        f"{len(names)} groups: no half of them has {shots} pictures of every label while the "
        "other half has at least one; fewer shots or other groups are needed"
    )
