"""Limits at work, as text that people read and with a kind that programs read."""

from typing import Literal, get_args

LimitKind = Literal[
    "joint_limit",
    "speed",
    "slowed",
    "singularity",
    "unreachable",
    "collision",
    "workspace",
    "gripper",
    "unknown_pose",
    "unknown_joint",
    "never_ends",
    "too_long",
    "note",
    "other",
]
"""``speed``: less fast than asked for. ``slowed``: for a while, to keep clear of another limit.
``note``: no limit, only what is going on."""
KINDS: tuple[str, ...] = get_args(LimitKind)


class AtWork(str):
    """A limit at work, or a refusal, in plain words; ``kind`` says which it is.

    A text, so that whoever only shows it need not know of kinds.
    """

    kind: LimitKind
    plain: str
    """The text without the places it was said of."""

    def __new__(cls, text: str, kind: LimitKind) -> "AtWork":
        """``text`` with its kind."""
        made = super().__new__(cls, text)
        made.kind, made.plain = kind, text
        return made

    def at(self, place: str) -> "AtWork":
        """The same, said of a place: ``step 2 of 3: ...``."""
        made = AtWork(f"{place}: {self}", self.kind)
        made.plain = self.plain
        return made


def with_kind(text: str) -> AtWork:
    """``text`` with its kind; ``other`` when it has none."""
    return text if isinstance(text, AtWork) else AtWork(text, "other")
