"""Settings that are compared: the paper as written, and the product's modes."""

from typing import Any

from app.config import PipelineSettings

ALONE = {"turns": [0.0], "cuts": [], "trims": [0.0], "shears": []}
PAPER: dict[str, Any] = {
    "binarise": {"channel": "luminance"},
    "wrist": {"mode": "histogram"},
    "match": {**ALONE, "features": "binary"},
}


def compared() -> dict[str, PipelineSettings]:
    """Name to settings: the paper, the silhouette by threshold and as it suits, landmarks."""
    off = {"landmarks": {"mode": "off"}}
    chosen: dict[str, dict[str, Any]] = {
        "paper": {**PAPER, "binarise": {**PAPER["binarise"], "mode": "threshold"}},
        "threshold": {"binarise": {"mode": "threshold"}},
        "silhouette": off,
        "landmarks": {"landmarks": {"mode": "on"}},
    }
    return {name: PipelineSettings.model_validate(values) for name, values in chosen.items()}
