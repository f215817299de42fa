"""One 640x480 JPEG to match, one thread: time of each stage, in ms.

::

    python -m benchmarks.pipeline_speed --save benchmarks/pipeline_speed.json

The gallery is the starter set's first five samples a gesture (ten gestures); the frames are the
synthetic operator's, as JPEG of quality 80. Only frames that reach the match are counted. ``cpu``
is the thread's own processor time, which other programs on the machine do not lengthen.
Must hold: median at most 2.5 ms, 99th percentile at most 6 ms.
"""

import os

# Before numpy: its matrix product would start a thread a core for a tenth of a millisecond's work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from pathlib import Path
from time import perf_counter, thread_time

import cv2
import numpy as np
import simplejpeg

from app.config import PipelineSettings
from app.gestures.synthetic import CLIP, SyntheticOperator
from app.pipeline import STAGES, Gallery, PcaMatcher, Pipeline
from benchmarks.report import arguments, percentiles, report

STARTER = Path(__file__).resolve().parents[1] / "gesture_db"


def starter_gallery(samples: int) -> Gallery:
    """The first samples of each gesture of the starter set."""
    labels, templates = [], []
    for folder in sorted(path for path in STARTER.iterdir() if path.is_dir()):
        for path in sorted(folder.glob("*.png"))[:samples]:
            picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            assert picture is not None
            labels.append(folder.name)
            templates.append((picture > 127).astype(np.uint8))
    return Gallery(tuple(labels), np.stack(templates))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--samples", type=int, default=5, help="templates a gesture")
    parser.add_argument("--rounds", type=int, default=3, help="times the clip is played")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    settings = PipelineSettings()
    start = perf_counter()
    matcher = PcaMatcher.fit(starter_gallery(options.samples), settings.match)
    fit_ms = (perf_counter() - start) * 1000
    pipeline = Pipeline(settings, matcher)
    frames = [
        simplejpeg.encode_jpeg(np.ascontiguousarray(frame), 80, "BGR", colorsubsampling="420")
        for frame in SyntheticOperator(CLIP).frames()
    ]
    times: dict[str, list[float]] = {stage: [] for stage in (*STAGES, "total", "cpu")}
    everything = []
    for number in range(options.rounds * len(frames)):
        jpeg = frames[number % len(frames)]
        cpu, wall = thread_time(), perf_counter()
        result = pipeline(jpeg, seq=number, now=number / 30)
        everything.append((perf_counter() - wall) * 1000)
        if result.match is not None:
            times["cpu"].append((thread_time() - cpu) * 1000)
            for stage, ms in result.timing_ms.items():
                times[stage].append(ms)
    figures = {f"{stage} ms": percentiles(values) for stage, values in times.items()}
    figures["any frame ms"] = percentiles(everything)
    figures["fit of the gallery ms"] = percentiles([fit_ms])
    report(figures, options)


if __name__ == "__main__":
    main()
