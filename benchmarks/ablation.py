"""What each step of recognition adds, on the photographs that training keeps aside.

::

    python -m benchmarks.ablation --data ../shared/data --mask-model held-mask.onnx \
        --shape-model held-shape.onnx --save ablation.json --markdown ablation.md

Each row has all steps of the rows above it. Only rooms (``HELD_ROOMS``) and people (``HELD_PEOPLE``
of ``training/photos.py``) that the first two stages of training never saw are measured, drawn at
random as ``farhand evaluate`` does; in the last column no asked photograph shares its room with an
enrolled one. The networks that are shipped saw all photographs: the rows with networks are honest
only with networks that did not (training/README.md, "Figures").
"""

import argparse
import importlib
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import cv2

from app.config import PipelineSettings
from app.errors import Invalid
from app.pipeline.evaluate import evaluate
from training.photos import choose

ALONE = {"turns": [0.0], "cuts": [], "trims": [0.0], "shears": []}
ROOM = "^[^-]+"
"""In webcam-box the room is what stands before the first dash of a file's name."""

Values = dict[str, dict[str, Any]]
PAPER: Values = {
    "binarise": {"mode": "threshold", "channel": "luminance"},
    "wrist": {"mode": "histogram"},
    "match": {**ALONE, "features": "binary"},
}
STEPS: tuple[tuple[str, Values], ...] = (
    ("the paper as written", {}),
    ("threshold on Cr", {"binarise": {"channel": "cr"}}),
    ("+ wrist by the palm's circle", {"wrist": {"mode": "circle"}}),
    ("+ signed distance features", {"match": {"features": "distance"}}),
    ("+ views", {"match": {"turns": None, "cuts": None, "trims": None, "shears": None}}),
    ("+ learned mask", {"binarise": {"mode": "learned"}}),
    ("+ learned shape features", {"match": {"features": "shape"}}),
    ("+ the way chosen by the picture (as shipped)", {"binarise": {"mode": "auto"}}),
)
"""Name of a row, and what it changes in the one above; None is the product's own default."""


class Column(NamedTuple):
    """One column: a set, how it is split, and the photographs enrolled a label."""

    title: str
    folder: str
    group: str | None
    shots: tuple[int, ...]


COLUMNS = (
    Column("digits, other people", "digits", None, (1, 5, 20)),
    Column("webcam box, other rooms", "webcam-box", None, (1, 5, 20)),
    # Of one sign there are 21 photographs in all rooms together: 20 of them cannot be had in half.
    Column("enrolled in one half of these rooms, asked in the other", "webcam-box", ROOM, (1, 5)),
)


def rows() -> Iterator[tuple[str, PipelineSettings]]:
    """Each row's name and settings."""
    values: Values = {section: dict(fields) for section, fields in PAPER.items()}
    for name, changes in STEPS:
        for section, fields in changes.items():
            values[section] |= fields
        given = {
            section: {key: value for key, value in fields.items() if value is not None}
            for section, fields in values.items()
        }
        # Each step of the silhouette's way; landmarks are measured by benchmarks.recognition.
        yield name, PipelineSettings.model_validate({**given, "landmarks": {"mode": "off"}})


@contextmanager
def kept_aside(folder: Path) -> Iterator[Path]:
    """A folder of links to the photographs that training does not see."""
    with TemporaryDirectory() as temporary:
        for path in choose(folder, held=True):
            link = Path(temporary, path.parent.name, path.name)
            link.parent.mkdir(exist_ok=True)
            link.symlink_to(path.resolve())
        yield Path(temporary)


def measure(data: Path, trials: int, seed: int) -> dict[str, dict[str, list[float | None]]]:
    """Row to column to accuracy by number of photographs; None where there are too few."""
    table: dict[str, dict[str, list[float | None]]] = {}
    for name, settings in rows():
        table[name] = {}
        for column in COLUMNS:
            with kept_aside(data / column.folder) as photos:
                table[name][column.title] = [
                    accuracy(photos, shots, trials, seed, settings, column.group)
                    for shots in column.shots
                ]
        print(name, table[name], file=sys.stderr, flush=True)
    return table


def accuracy(
    photos: Path, shots: int, trials: int, seed: int, settings: PipelineSettings, group: str | None
) -> float | None:
    try:
        result = evaluate(
            photos, shots=shots, trials=trials, seed=seed, settings=settings, group=group
        )
    except Invalid as error:
        print(f"{shots} photographs a label: {error.message}", file=sys.stderr)
        return None
    return round(float(result["accuracy"]["mean"]), 4)


def markdown(table: dict[str, dict[str, list[float | None]]]) -> str:
    """The table of docs/recognition.md."""
    heads = [f"{column.title}: {' / '.join(map(str, column.shots))}" for column in COLUMNS]
    lines = ["| | " + " | ".join(heads) + " |", "|---|" + "---|" * len(heads)]
    for name, figures in table.items():
        cells = [
            " / ".join("-" if value is None else f"{value:.2f}" for value in figures[column.title])
            for column in COLUMNS
        ]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True, help="folder of the photographs")
    parser.add_argument("--mask-model", type=Path, help="in place of the mask network shipped")
    parser.add_argument("--shape-model", type=Path, help="in place of the shape network shipped")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--save", type=Path, help="write the figures to this JSON file")
    parser.add_argument("--markdown", type=Path, help="write the table to this file")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    for module, name, file in (
        ("mask", "MODEL", options.mask_model),
        ("features", "SHAPE_MODEL", options.shape_model),
    ):
        if file is not None:
            vars(importlib.import_module(f"app.pipeline.{module}"))[name] = str(file.resolve())
    table = measure(options.data, options.trials, options.seed)
    text = markdown(table)
    print(text)
    if options.save:
        options.save.write_text(
            json.dumps(
                {
                    "trials": options.trials,
                    "seed": options.seed,
                    "mask_model": options.mask_model and options.mask_model.name,
                    "shape_model": options.shape_model and options.shape_model.name,
                    "accuracy": table,
                },
                indent=1,
            )
            + "\n"
        )
    if options.markdown:
        options.markdown.write_text(text)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main()
