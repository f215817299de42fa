"""How every benchmark reports: a Markdown table on standard output, JSON with ``--save``."""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

KEPT = "kept"
"""Column that says whether what was promised held; a ``NO`` makes the program fail."""

Row = Mapping[str, float | str]


def percentiles(values: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and longest of ``values``, and how many there are."""
    array = np.asarray(values, dtype=float)
    if not array.size:
        return {"n": 0}
    return {
        "n": int(array.size),
        "p50": float(np.percentile(array, 50)),
        "p99": float(np.percentile(array, 99)),
        "max": float(array.max()),
    }


def promise(asked: str, *, kept: bool) -> dict[str, str]:
    """The columns that hold a row against what was promised."""
    return {"asked": asked, KEPT: "yes" if kept else "NO"}


def arguments(description: str | None, *, runs: int | None = None) -> argparse.ArgumentParser:
    """A parser with the options that all benchmarks share.

    Args:
        description: The module's docstring.
        runs: Default of ``--runs``, for benchmarks that repeat something.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--save", type=Path, help="write the figures to this JSON file")
    parser.add_argument("--compare", type=Path, help="show a JSON file saved before beside them")
    if runs is not None:
        parser.add_argument(
            "--runs", type=int, default=runs, help=f"how often each is done (default {runs})"
        )
    return parser


def report(figures: Mapping[str, Row], options: argparse.Namespace) -> None:
    """Print the figures, a row each, and save or compare them as asked.

    Raises:
        SystemExit: with status 1, when a row says that a promise was not kept.
    """
    before: dict[str, dict[str, float | str]] = {}
    if options.compare is not None:
        before = json.loads(options.compare.read_text())
    print(markdown(figures, before))
    if options.save is not None:
        options.save.write_text(json.dumps(figures, indent=2) + "\n")
    broken = [name for name, row in figures.items() if row.get(KEPT) == "NO"]
    if broken:
        raise SystemExit(f"not kept: {', '.join(broken)}")


def markdown(figures: Mapping[str, Row], before: Mapping[str, Row]) -> str:
    """One table with the columns of all rows, in the order in which they first come."""
    columns = list(dict.fromkeys(column for row in figures.values() for column in row))
    lines = [["", *columns], ["---"] * (len(columns) + 1)]
    for name, row in figures.items():
        old = before.get(name, {})
        lines.append([name, *(_cell(row.get(each), old.get(each)) for each in columns)])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _cell(value: float | str | None, old: float | str | None) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    ratio = f" (x{value / old:.2f})" if old and not isinstance(old, str) else ""
    return f"{value:.4g}{ratio}"
