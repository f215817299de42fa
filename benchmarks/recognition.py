"""Recognition on photographs: the product's settings, and what each departure from the paper gives.

::

    python -m benchmarks.recognition ../shared/data/digits --trials 10 --save benchmarks/digits.json

Rows are settings, columns the accuracy with 1, 5 and 20 enrolled photographs a label, forced
choice. The last rows are about rejection: three labels are not enrolled, and it is counted which
part of the others is recognised right, taken for another, or rejected, and which part of the three
is taken for an enrolled one.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2

from app.config import PipelineSettings
from app.pipeline.evaluate import UNKNOWN, evaluate, find_images
from benchmarks.report import arguments, report

ALONE = {"turns": [0.0], "cuts": [], "trims": [0.0]}
VARIANTS: dict[str, dict[str, Any]] = {
    "as shipped": {},
    "without views": {"match": ALONE},
    "binary features, no views": {"match": {**ALONE, "features": "binary"}},
    "histogram wrist, binary, no views": {
        "wrist": {"mode": "histogram"},
        "match": {**ALONE, "features": "binary"},
    },
    "arm left on, binary, no views": {
        "wrist": {"mode": "off"},
        "match": {**ALONE, "features": "binary"},
    },
    "the paper: luminance as well": {
        "binarise": {"channel": "luminance"},
        "wrist": {"mode": "histogram"},
        "match": {**ALONE, "features": "binary"},
    },
}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("directory", type=Path, help="LABEL/*.jpg")
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only-shipped", action="store_true", help="no other settings")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    figures: dict[str, dict[str, float]] = {}
    for name, values in VARIANTS.items():
        if options.only_shipped and values:
            continue
        settings = PipelineSettings.model_validate(values)
        row = figures[name] = {}
        for shots in (1, 5, 20):
            result = evaluate(
                options.directory, shots, options.trials, options.seed, settings=settings
            )
            row[f"{shots}"] = result["accuracy"]["mean"]
        row["no hand"] = result["no_hand"]
        row["ms p50"] = result["ms_per_image"]["p50"]
    for shots in (1, 5, 20):
        figures[f"rejection, {shots} shots"] = rejection(
            options.directory, shots, options.trials, options.seed
        )
    report(figures, options)


def rejection(directory: Path, shots: int, trials: int, seed: int) -> dict[str, float]:
    """Figures with the last three labels left out."""
    labels = list(find_images(directory))
    with TemporaryDirectory() as folder:
        known = Path(folder)
        for label in labels[:-3]:
            (known / label).symlink_to((directory / label).resolve())
        result = evaluate(known, shots, trials, seed, reject=True, unknown=directory)
    counts = result["confusion"]
    total = sum(sum(row.values()) for row in counts.values())
    right = sum(row.get(label, 0) for label, row in counts.items()) / total
    unknown = sum(row.get(UNKNOWN, 0) for row in counts.values()) / total
    return {
        "right": right,
        "wrong": 1 - right - unknown,
        "rejected": unknown,
        "unknown accepted": result["unknown_accepted"],
    }


if __name__ == "__main__":
    main()
