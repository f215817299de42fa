"""The steps of a sequence, with its repeats counted out."""

from collections.abc import Iterator
from typing import NamedTuple

from app.link.actions import Repeat, Step
from app.link.actions import Sequence as SequenceAction


class Place(NamedTuple):
    """One step to be done, and where it is written. All numbers count from 1."""

    action: Step
    step: int
    """In the sequence."""
    of: int
    """Steps of the sequence."""
    time: int | None = None
    """Of a repeat."""
    times: int | None = None
    inner: int | None = None
    """Step in the repeat."""

    def __str__(self) -> str:
        """``step 2 of 3``, or ``step 2 of 3 (time 4 of 5, step 1)``."""
        name = f"step {self.step} of {self.of}"
        if self.time is None:
            return name
        return f"{name} (time {self.time} of {self.times}, step {self.inner})"


def counted_out(sequence: SequenceAction) -> Iterator[Place]:
    """What is to be done, in its order."""
    of = len(sequence.steps)
    for number, step in enumerate(sequence.steps, start=1):
        if not isinstance(step, Repeat):
            yield Place(step, number, of)
            continue
        for time in range(1, step.times + 1):
            for inner, each in enumerate(step.steps, start=1):
                yield Place(each, number, of, time, step.times, inner)
