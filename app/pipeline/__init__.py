"""From bytes to gestures: one stage a file, their order in :mod:`app.pipeline.pipeline`."""

from app.pipeline.match import Gallery, PcaMatcher
from app.pipeline.pipeline import STAGES, Pipeline
from app.pipeline.still import extract_template
from app.pipeline.template import pack_template, unpack_template
from app.pipeline.types import Extraction, FrameResult, GestureEvent, Match, WristCut

__all__ = [
    "STAGES",
    "Extraction",
    "FrameResult",
    "Gallery",
    "GestureEvent",
    "Match",
    "PcaMatcher",
    "Pipeline",
    "WristCut",
    "extract_template",
    "pack_template",
    "unpack_template",
]
