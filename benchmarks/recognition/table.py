"""The figures as Markdown, for RESULTS.md."""

from collections.abc import Mapping
from typing import Any

PEER = "MediaPipe Hands"
TIMES = {
    "wall_ms_p50": "median",
    "wall_ms_p99": "99th percentile",
    "cpu_ms_p50": "processor, median",
}


def markdown(result: Mapping[str, Any]) -> str:
    """Tables of a result as ``python -m benchmarks.recognition --save`` writes it."""
    lines = []
    for name, figures in result["sets"].items():
        lines += [f"### {name}", "", _about(figures), ""]
        lines += _main_table(figures)
        if figures["rooms"]:
            lines += ["", "Accuracy with 5 photos, room by room:", "", *_rooms(figures)]
        lines.append("")
    for pair, figures in result["across"].items():
        lines += [f"### Enrolled from {pair}", "", "| | 1 photo | 5 | 20 |", "|---|---|---|---|"]
        lines += [
            f"| {name} | {' | '.join(_part(row[shots]) for shots in ('1', '5', '20'))} |"
            for name, row in figures.items()
        ]
        lines.append("")
    return "\n".join(lines)


def _about(figures: Mapping[str, Any]) -> str:
    count = figures["groups"]
    split = f"{count} {figures['kind']}, half enrolled from, half asked" if count else "no groups"
    return f"{figures['photos']} photos of {figures['labels']} labels; {split}; forced choice."


def _main_table(figures: Mapping[str, Any]) -> list[str]:
    lines = [
        "| | 1 photo | 5 | 20 | no hand | unknown accepted while 90% pass | "
        "missed while 5% accepted |"
    ]
    lines.append("|---" * 7 + "|")
    for name, row in figures["methods"].items():
        marks = row["accuracy"]
        curve = row["rejection"] or {}
        cells = [_part(marks[shots] and marks[shots]["mean"]) for shots in ("1", "5", "20")]
        cells.append(_part(row["no_hand"]))
        cells.append(_part(curve.get("accepted_at_90_percent_passed")))
        cells.append(_part(curve.get("missed_at_5_percent_accepted")))
        lines.append(f"| {name} | {' | '.join(cells)} |")
    kinds = [(kind, key) for kind in ("photo", "video") for key in TIMES]
    lines += ["", f"| ms | {' | '.join(f'{kind}, {TIMES[key]}' for kind, key in kinds)} |"]
    lines.append("|---" * (1 + len(kinds)) + "|")
    for name, row in figures["methods"].items():
        cells = [f"{row[kind][key]:.1f}" if row[kind] else "-" for kind, key in kinds]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def _rooms(figures: Mapping[str, Any]) -> list[str]:
    methods = figures["methods"]
    lines = [
        f"| room | photos | {' | '.join(methods)} |",
        "|---|---" * 1 + "|---" * len(methods) + "|",
    ]
    for room, count in figures["rooms"].items():
        cells = []
        for row in methods.values():
            marks = row["accuracy"]["5"]
            cells.append(_part(marks and marks["per_group"].get(room)))
        lines.append(f"| {room} | {count} | {' | '.join(cells)} |")
    return lines


def _part(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
