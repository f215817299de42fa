"""Minutes of webcam: what starts that should not, what does not start that should, and how soon.

::

    python -m benchmarks.streams [--operator drawn digits webcam] [--minutes 10]
        [--transitions 200] [--photos ../shared/data] [--save FILE]

For every operator (``sets.py``) two streams are played through the pipeline as it is shipped: one
without any enrolled gesture, and one of changes between enrolled gestures. ``measure.py`` says what
each column counts. Without the photographs the drawn operator stands before plain walls, and the
others are left out. The clock is virtual, so that the figures do not depend on the machine; only
``pipeline ms`` does. Must hold: at most one false start in ten minutes, no wrong start in 200
transitions, a start within 300 ms of rest.
"""

import os

# Before numpy: its matrix product would start a thread a core for a tenth of a millisecond's work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import json
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

from app.config import PipelineSettings
from app.pipeline import Gallery
from benchmarks.report import arguments, report
from benchmarks.streams import measure, sets
from benchmarks.streams.scene import Frame

ROOT = Path(__file__).resolve().parents[2]


def play(
    stream: Iterable[Frame], settings: PipelineSettings, gallery: Gallery, fps: float
) -> tuple[measure.Figures, float]:
    """The figures of a stream, and the median of a frame's processing time in ms."""
    seen = list(measure.record(stream, settings, gallery, fps))
    figures = measure.count([one.label for one in seen], measure.decide(seen, settings), fps)
    return figures, float(np.median([one.ms for one in seen]))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--operator", nargs="*", default=["drawn", "digits", "webcam"])
    parser.add_argument("--minutes", type=float, default=10.0, help="without a gesture")
    parser.add_argument("--transitions", type=int, default=200)
    parser.add_argument("--photos", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--boxes", type=Path, help="cache of where the hands are; made if missing")
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--settings", default="{}", help="of the pipeline, as JSON")
    parser.add_argument("--when", action="store_true", help="tell when what started wrongly")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    settings = PipelineSettings.model_validate(json.loads(options.settings))
    boxes = options.boxes or Path(tempfile.gettempdir()) / "farhand-hand-boxes.json"
    rows: dict[str, dict[str, float]] = {}
    for name in options.operator:
        if name != "drawn" and not options.photos.is_dir():
            print(f"{name}: left out, there are no photographs in {options.photos}")
            continue
        operator = sets.make(name, options.photos, boxes)
        gallery = operator.gallery(settings)
        fps, seed = options.fps, options.seed
        nothing, ms = play(
            operator.nothing(options.minutes * 60, seed, fps), settings, gallery, fps
        )
        changes, _ = play(
            operator.transitions(options.transitions, seed, fps), settings, gallery, fps
        )
        rows[f"{name}: no gesture"] = {
            "minutes": nothing.seconds / 60,
            "false starts": len(nothing.false_starts),
            "pipeline ms": ms,
        }
        latency = changes.latency_ms or [float("nan")]
        rows[f"{name}: changes"] = {
            "transitions": changes.transitions,
            "wrong starts": len(changes.wrong_starts),
            "mistaken": len(changes.mistaken),
            "rests": changes.rests,
            "missed": changes.missed,
            "dropped": changes.dropped,
            "rest to start p50, ms": float(np.percentile(latency, 50)),
            "p99": float(np.percentile(latency, 99)),
            "max": max(latency),
        }
        if options.when:
            print(name, "false", nothing.false_starts, file=sys.stderr)
            print(name, "wrong", changes.wrong_starts, file=sys.stderr)
            print(name, "mistaken", changes.mistaken, file=sys.stderr)
    report(rows, options)


if __name__ == "__main__":
    main()
