"""Learning a gallery: what takes long, in a module that a process for work starts with quickly."""

from collections.abc import Callable, Sequence

import numpy as np

from app.config import PipelineSettings
from app.pipeline import Gallery, PcaMatcher, unpack_template
from app.pipeline.hand_landmarks.shape import HandShape

Progress = Callable[[int, int], None]
"""Told how much is done, of how much; what it raises ends the work."""
Samples = Sequence[tuple[str, bytes, bytes | None]]
"""Name, template (600 bytes) and landmarks (254 bytes, or None) of every active sample."""


def fit(
    samples: Samples,
    settings: PipelineSettings,
    progress: Progress = lambda done, total: None,
) -> PcaMatcher:
    """A matcher for these samples."""
    images = [unpack_template(template) for _, template, _ in samples]
    stacked = np.stack(images) if images else np.zeros((0, 80, 60), np.uint8)
    hands = tuple(None if hand is None else HandShape.unpack(hand) for _, _, hand in samples)
    gallery = Gallery(tuple(name for name, _, _ in samples), stacked, hands)
    return PcaMatcher.fit(gallery, settings.match, progress)
