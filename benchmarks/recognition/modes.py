"""Settings that are compared: the paper as written, and the product's modes."""

from typing import Any, get_args

from app.config import BinariseSettings, PipelineSettings

ALONE = {"turns": [0.0], "cuts": [], "trims": [0.0], "shears": []}
PAPER: dict[str, Any] = {
    "binarise": {"channel": "luminance"},
    "wrist": {"mode": "histogram"},
    "match": {**ALONE, "features": "binary"},
}


def mask_modes() -> tuple[str, ...]:
    """The values of ``binarise.mode``; none in a product that has only the threshold."""
    field = BinariseSettings.model_fields.get("mode")
    return get_args(field.annotation) if field else ()


def compared() -> dict[str, PipelineSettings]:
    """Name to settings: the paper, then each mode of the product."""
    found = mask_modes()
    threshold = {"mode": "threshold"} if "threshold" in found else {}
    chosen: dict[str, dict[str, Any]] = {
        "paper": {**PAPER, "binarise": {**PAPER["binarise"], **threshold}},
        "threshold": {"binarise": threshold},
    }
    chosen |= {mode: {"binarise": {"mode": mode}} for mode in found if mode != "threshold"}
    return {name: PipelineSettings.model_validate(values) for name, values in chosen.items()}
