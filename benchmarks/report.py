"""How every benchmark reports: a table on standard output, JSON with ``--save``."""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np


def percentiles(values: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and longest of ``values``, and how many there are."""
    array = np.asarray(values, dtype=float)
    return {
        "n": int(array.size),
        "p50": float(np.percentile(array, 50)),
        "p99": float(np.percentile(array, 99)),
        "max": float(array.max()),
    }


def arguments(description: str | None) -> argparse.ArgumentParser:
    """A parser with the options that all benchmarks share."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--save", type=Path, help="write the figures to this JSON file")
    parser.add_argument("--compare", type=Path, help="show a JSON file saved before beside them")
    return parser


def report(figures: Mapping[str, Mapping[str, float]], options: argparse.Namespace) -> None:
    """Print the figures, row by row, and save or compare them as asked."""
    before: dict[str, dict[str, float]] = {}
    if options.compare is not None:
        before = json.loads(options.compare.read_text())
    for name, values in figures.items():
        cells = []
        for column, value in values.items():
            cell = f"{column} {value:.4g}"
            old = before.get(name, {}).get(column)
            if old:
                cell += f" (x{value / old:.2f})"
            cells.append(cell)
        print(f"{name:32} " + "  ".join(cells))
    if options.save is not None:
        options.save.write_text(json.dumps(figures, indent=2) + "\n")
