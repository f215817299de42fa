"""One photograph enrolled, and the same one before the webcam: does the gesture start, and when?

::

    python -m benchmarks.same_photo --photos ../shared/data/webcam-full [--runs 10]

Whole webcam frames, evenly drawn from every label and room. The photograph alone is enrolled; then
it is played for two seconds at 640 wide, with fresh sensor noise and JPEG as a browser sends it.
What is enrolled goes another way through the decoder than what is live, so that the two are held
together here. Must hold: 0.9 of them start within half a second.
"""

from collections import defaultdict
from pathlib import Path

import cv2
import numpy as np
import simplejpeg

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.pipeline import Gallery, PcaMatcher, Pipeline, extract_template
from app.pipeline.replay import JPEG_QUALITY
from app.pipeline.types import U8
from benchmarks.report import arguments, percentiles, promise, report

FPS = 30
FRAMES = 2 * FPS
NOISE = 2.0
"""Levels, standard deviation: a laptop's webcam by lamplight."""


def chosen(folder: Path, each: int) -> list[Path]:
    """So many photographs of every label and room, in the order of their names."""
    groups: dict[tuple[str, str], list[Path]] = defaultdict(list)
    for path in sorted(folder.glob("*/*.jpg")):
        groups[path.parent.name, path.name.split("-")[0]].append(path)
    return [path for paths in groups.values() for path in paths[:: -(-len(paths) // each)]]


def noisy(picture: U8, generator: np.random.Generator) -> bytes:
    """A webcam's frame of a scene, as the page sends it."""
    raw = picture + generator.normal(0, NOISE, picture.shape)
    jpeg: bytes = simplejpeg.encode_jpeg(
        np.ascontiguousarray(raw.clip(0, 255).astype(np.uint8)),
        JPEG_QUALITY,
        "BGR",
        colorsubsampling="420",
    )
    return jpeg


def show(path: Path, settings: PipelineSettings) -> tuple[float | None, float] | None:
    """Seconds to the start (None: it never did) and the median distance; None: not enrolled."""
    try:
        enrolled = extract_template(path.read_bytes(), settings, whole=False)
    except ImageRefused:
        return None
    matcher = PcaMatcher.fit(Gallery(("shown",), enrolled.template[None]), settings.match)
    pipeline = Pipeline(settings, matcher)
    picture = cv2.imread(str(path))
    assert picture is not None
    height = round(picture.shape[0] * 640 / picture.shape[1])
    scene = np.asarray(cv2.resize(picture, (640, height)), np.uint8)
    generator = np.random.default_rng(0)
    started: float | None = None
    distances = []
    for seq in range(FRAMES):
        result = pipeline(noisy(scene, generator), seq=seq, now=seq / FPS)
        if result.match is not None:
            distances.append(result.match.distance)
        if started is None and result.event is not None and result.event.phase == "start":
            started = seq / FPS
    return started, float(np.median(distances)) if distances else np.inf


def main() -> None:
    """Play them and print the table."""
    parser = arguments(__doc__, runs=10)
    parser.add_argument("--photos", type=Path, required=True)
    options = parser.parse_args()
    paths = chosen(options.photos, options.runs)
    shown = [show(path, PipelineSettings()) for path in paths]
    enrolled = [one for one in shown if one is not None]
    starts = [start for start, _ in enrolled if start is not None]
    soon = sum(start <= 0.5 for start in starts)
    report(
        {
            "enrolled": {"n": len(enrolled), "refused": len(shown) - len(enrolled)},
            "started": {"n": len(starts)},
            "within 0.5 s": {
                "n": soon,
                **promise("9 of 10", kept=soon >= 0.9 * len(enrolled)),
            },
            "to the start s": percentiles(starts),
            "distance": percentiles([distance for _, distance in enrolled]),
        },
        options,
    )


if __name__ == "__main__":
    main()
