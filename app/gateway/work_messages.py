"""What a pool and its processes say to one another, pickled, over a pair of sockets."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple


@dataclass(frozen=True)
class Piece:
    """A piece of work: ``function(*arguments)``, which must be known by its module and name."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    tells: bool
    """Whether it takes ``progress``, a function that is told how much is done, of how much."""
    memory: int
    """Bytes that it may take beside what the process has."""
    cpu_s: float
    """Processor time that it may take, s."""


class Told(NamedTuple):
    """What the process says of the piece it has."""

    kind: Literal["progress", "done", "refused", "memory", "broken"]
    value: Any
    """``(done, total)``, the result, the error, None, or a traceback."""
