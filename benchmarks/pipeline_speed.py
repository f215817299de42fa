"""One 640x480 JPEG to match, one thread: time of each stage, in ms.

::

    python -m benchmarks.pipeline_speed --save benchmarks/pipeline_speed.json

The gallery is the starter set's first five samples a gesture (ten gestures); the frames are the
synthetic operator's, as JPEG of quality 80, once for each way to the mask that ``binarise.mode``
has. Only frames that reach the match are counted. ``cpu`` is the thread's own processor time, which
other programs on the machine do not lengthen. ``--quiet-room`` adds frames that do not change but
for the camera's noise, so that the network need not run on each; ``skipped`` is the share of the
frames with a mask by network on which it did not.
Must hold: with the threshold median at most 2.5 ms and 99th percentile at most 6 ms; with the
learned mask median at most 8 ms.
"""

import os

# Before numpy: its matrix product would start a thread a core for a tenth of a millisecond's work.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Iterator
from pathlib import Path
from time import perf_counter, thread_time

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.gestures.synthetic import CLIP, SyntheticOperator
from app.pipeline import STAGES, Gallery, PcaMatcher, Pipeline
from benchmarks.recognition.modes import compared
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
    parser.add_argument("--quiet-room", action="store_true", help="a picture at rest, too")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    pictures = list(SyntheticOperator(CLIP).frames())
    streams = {"": [to_jpeg(picture) for picture in pictures] * options.rounds}
    if options.quiet_room:
        streams["at rest, "] = at_rest(pictures[len(pictures) // 2], len(pictures))
    figures: dict[str, dict[str, float]] = {}
    for mode, settings in compared().items():
        start = perf_counter()
        matcher = PcaMatcher.fit(starter_gallery(options.samples), settings.match)
        fit_ms = (perf_counter() - start) * 1000
        for stream, frames in streams.items():
            name = f"{mode}, {stream}"
            figures |= {f"{name}{row}": row_of for row, row_of in play(frames, settings, matcher)}
            figures[f"{name}fit of the gallery ms"] = percentiles([fit_ms])
    report(figures, options)


def to_jpeg(picture: NDArray[np.uint8]) -> bytes:
    data: bytes = simplejpeg.encode_jpeg(
        np.ascontiguousarray(picture), 80, "BGR", colorsubsampling="420"
    )
    return data


def at_rest(picture: NDArray[np.uint8], count: int) -> list[bytes]:
    """The same picture, each time with other sensor noise of 1.5 levels."""
    rng = np.random.default_rng(0)
    noisy = (picture + rng.normal(0, 1.5, picture.shape) for _ in range(count))
    return [to_jpeg(frame.clip(0, 255).astype(np.uint8)) for frame in noisy]


def play(
    frames: list[bytes], settings: PipelineSettings, matcher: PcaMatcher
) -> Iterator[tuple[str, dict[str, float]]]:
    """Rows of the report: every stage of the frames that reach a match, then any frame."""
    pipeline = Pipeline(settings, matcher)
    times: dict[str, list[float]] = {stage: [] for stage in (*STAGES, "total", "cpu")}
    everything, looks = [], []
    for number, jpeg in enumerate(frames):
        cpu, wall = thread_time(), perf_counter()
        result = pipeline(jpeg, seq=number, now=number / 30)
        everything.append((perf_counter() - wall) * 1000)
        if result.way.mode == "learned":
            looks.append(result.looks)
        if result.match is not None:
            times["cpu"].append((thread_time() - cpu) * 1000)
            for stage, ms in result.timing_ms.items():
                times[stage].append(ms)
    for stage, values in times.items():
        if values:
            yield f"{stage} ms", percentiles(values)
    yield "any frame ms", percentiles(everything)
    if looks:
        yield (
            "network",
            {"looks a frame": float(np.mean(looks)), "skipped": float(np.mean(np.equal(looks, 0)))},
        )


if __name__ == "__main__":
    main()
