"""Gallery: what is enrolled, and what matching a hand with it gives."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from app.errors import Invalid
from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.template import HEIGHT, WIDTH
from app.pipeline.types import F32, U8, Extraction, Look, Match


@dataclass(frozen=True)
class Gallery:
    """The enrolled templates.

    Attributes:
        labels: One name a template; names repeat.
        templates: (n, 80, 60) uint8 of 0 and 1.
        hands: The landmarks of each, None where it has none; or empty for none at all.

    Raises:
        Invalid: the numbers of labels, templates and hands differ, or the shape is another.
    """

    labels: tuple[str, ...]
    templates: U8
    hands: tuple[HandShape | None, ...] = ()

    def __post_init__(self) -> None:
        expected = (len(self.labels), HEIGHT, WIDTH)
        if self.templates.shape != expected:
            raise Invalid(f"templates of shape {self.templates.shape} where {expected} is needed")
        if self.hands and len(self.hands) != len(self.labels):
            raise Invalid(f"{len(self.hands)} hands for {len(self.labels)} templates")

    @classmethod
    def of(cls, photos: Sequence[tuple[str, Extraction]]) -> Self:
        """Photographs with their labels; at least one."""
        templates = np.stack([photo.template for _, photo in photos])
        hands = tuple(photo.hand for _, photo in photos)
        return cls(tuple(label for label, _ in photos), templates, hands)

    @classmethod
    def empty(cls) -> Self:
        """A gallery without any template."""
        return cls((), np.zeros((0, HEIGHT, WIDTH), np.uint8))


class Matched(NamedTuple):
    """The nearest gesture, the distance to each, and more; None, {}, None of an empty gallery."""

    match: Match | None
    distances: dict[str, float]
    look: Look | None = None


class Chart(NamedTuple):
    """The enrolled templates on the first two principal components, to be drawn.

    Attributes:
        at: (n, 2) the middle of each template's views, in the order of ``PcaMatcher.templates``.
        share: (2,) part of all that differs among the enrolled views that each axis shows; 0 for an
            axis that the gallery is too small to have.
    """

    at: F32
    share: F32
