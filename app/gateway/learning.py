"""Learning a gallery: what takes long, in a module that a process for work starts with quickly."""

from collections.abc import Callable, Sequence

import numpy as np

from app.config import PipelineSettings
from app.pipeline import Gallery, PcaMatcher, unpack_template

Progress = Callable[[int, int], None]
"""Told how much is done, of how much; what it raises ends the work."""
Pairs = Sequence[tuple[str, bytes]]
"""Name and template (600 bytes) of every active sample."""


def fit(
    templates: Pairs,
    settings: PipelineSettings,
    progress: Progress = lambda done, total: None,
) -> PcaMatcher:
    """A matcher for these samples."""
    images = [unpack_template(template) for _, template in templates]
    stacked = np.stack(images) if images else np.zeros((0, 80, 60), np.uint8)
    gallery = Gallery(labels=tuple(name for name, _ in templates), templates=stacked)
    return PcaMatcher.fit(gallery, settings.match, progress)
