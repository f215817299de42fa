"""Signs: does a hand show the starter sign that it is asked for, and what is different if not?

Fingers are compared, stretched or bent; one that is in doubt counts for neither. What is different
is a word with its numbers for the page, which has sentences for it in its languages, and a plain
sentence for everybody else.
"""

from typing import Any, NamedTuple

from app.errors import Invalid
from app.gestures.hand.poses import POSES
from app.gestures.hand.poses import stretched as of_pose
from app.pipeline.hand_landmarks.fingers import FINGERS, States, stretched
from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.quality import Finding

PROBLEM = "not_the_sign"
_NUMBERS = (
    "no finger",
    "one finger",
    "two fingers",
    "three fingers",
    "four fingers",
    "five fingers",
)


class Difference(NamedTuple):
    """How a hand differs from a sign.

    Attributes:
        code: ``palm_only`` (nothing is stretched), ``count`` (another number of fingers), or
            ``fingers`` (others).
        seen: How many fingers are stretched.
        asked: How many should be.
        stretch: Names of those that should be stretched, and are bent.
        bend: Names of those that should be bent, and are stretched.
    """

    code: str
    seen: int
    asked: int
    stretch: tuple[str, ...]
    bend: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """As docs/protocol.md has it."""
        return {**self._asdict(), "stretch": list(self.stretch), "bend": list(self.bend)}

    @property
    def finding(self) -> Finding:
        """The same for people."""
        seen, asked = _NUMBERS[self.seen], _NUMBERS[self.asked]
        verb = "is" if self.asked <= 1 else "are"
        match self.code:
            case "palm_only":
                message = f"only the palm is seen: {asked} {verb} asked"
            case "count":
                message = f"that is {seen}: {asked} {verb} asked"
            case _:
                wishes = [f"stretch the {_and(self.stretch)}"] if self.stretch else []
                wishes += [f"bend the {_and(self.bend)}"] if self.bend else []
                message = f"other fingers are asked: {', and '.join(wishes)}"
        return Finding(PROBLEM, message)


def known_sign(name: str) -> str:
    """The name of a starter sign.

    Raises:
        Invalid: there is none of that name.
    """
    if name not in POSES:
        known = ", ".join(POSES)
        raise Invalid(f"no sign is called {name[:40]!r}; there are {known}", field="sign")
    return name


def difference(hand: HandShape, sign: str) -> Difference | None:
    """How a hand differs from a starter sign; None where it does not, as far as is seen."""
    return compare(stretched(hand), of_pose(POSES[sign]))


def compare(seen: States, asked: tuple[bool, ...]) -> Difference | None:
    """The same by the states of the fingers, thumb first."""
    pairs = list(zip(FINGERS, seen, asked, strict=True))
    stretch = tuple(name for name, is_so, wanted in pairs if wanted and is_so is False)
    bend = tuple(name for name, is_so, wanted in pairs if not wanted and is_so is True)
    if not stretch and not bend:
        return None
    up, wanted = seen.count(True), asked.count(True)
    # With a finger in doubt a number would be a guess.
    sure = None not in seen
    if not any(state is not False for state in seen):
        code = "palm_only"
    elif sure and up != wanted:
        code = "count"
    else:
        code = "fingers"
    return Difference(code, up, wanted, stretch, bend)


def _and(names: tuple[str, ...]) -> str:
    """Fingers by name, as people say it."""
    said = [name if name == "thumb" else f"{name} finger" for name in names]
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} and {said[-1]}"
