"""docs/recognition.md cannot drift from the code."""

import re
from pathlib import Path

import numpy as np
import pytest

from app.config import PipelineSettings
from app.pipeline import choose, mask, palm, rejection
from app.pipeline.features import SHAPE_MODEL, SQUASH
from app.pipeline.network import load
from benchmarks.ablation import COLUMNS, STEPS, rows

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "recognition.md").read_text()
CARD = (ROOT / "training" / "MODEL_CARD.md").read_text()


def test_every_picture_is_there_and_small() -> None:
    pictures = re.findall(r"\]\((pictures/[a-z-]+\.png)\)", TEXT)
    assert len(pictures) == 4
    for picture in pictures:
        assert (ROOT / "docs" / picture).stat().st_size < 150_000


def test_every_file_it_names_is_there() -> None:
    for name in re.findall(r"`([a-z]+\.py)`", TEXT):
        assert (ROOT / "app" / "pipeline" / name).exists() or name == "config.py", name
    for target in re.findall(r"\]\((\.\./[\w/.]+|[\w]+\.md)\)", TEXT):
        assert (ROOT / "docs" / target).exists(), target


def test_every_setting_it_names_is_there() -> None:
    settings = PipelineSettings().model_dump()
    named = re.findall(r"`(binarise|match|wrist)\.([a-z_]+)`", TEXT)
    assert len(named) >= 8
    for section, field in named:
        if field != "py":
            assert field in settings[section], f"{section}.{field}"


def test_the_numbers_are_those_of_the_code() -> None:
    settings = PipelineSettings()
    numbers = {
        f"at most {choose.LIGHT} levels": choose,
        f"chroma at most {choose.COLOUR},": choose,
        f"at least {choose.PLAIN:.0%} are alike": choose,
        f"down to {choose.ROOM:.0%}": choose,
        f"is under {choose.AGREE}, the network": choose,
        f"for {choose.DOUBT} frames": choose,
        f"over {mask.THRESHOLD} a pixel is hand": mask,
        f"reaches {mask.REACH} `r` from the palm away from the arm, {mask.ASIDE} `r`": mask,
        f"and {mask.BEHIND} `r` towards the arm": mask,
        f"at {mask.FINE:g} pixels a palm radius": mask,
        f"up to {mask.FARTHEST:g} `r`": mask,
        f"from {palm.ALMOST} of the largest": palm,
        f"down to {palm.KEPT} of it": palm,
        f"at least {mask.CELLS} cells": mask,
        f"more than {mask.BESIDE} levels": mask,
        f"{mask.AGAIN} frames have passed, and after {mask.NEW} frames": mask,
        f"less than {mask.WORTH_IT:.0%} of the picture": mask,
        f"at most {mask.SAME_MEAN} levels in the mean and {mask.SAME_MOST:g} at most": mask,
        f"about {mask.SIDE}x{mask.SIDE} pixels": mask,
        f"under {settings.binarise.min_sure} (`binarise.min_sure`)": settings,
        f"differ by less than {settings.binarise.min_contrast:g} levels": settings,
        f"`wrist.radii` = {settings.wrist.radii} palm radii": settings,
        f"`k` = {settings.match.components} leading": settings,
        f"`s` is {SQUASH} of the view's": settings,
        f"{rejection.OWN_REACH} times the distance": rejection,
        f"{rejection.OTHER_REACH} times the median": rejection,
    }
    missing = [text for text in numbers if text not in TEXT.replace("\n", " ")]
    assert missing == []


def test_the_ablation_has_the_table_s_rows_and_ends_at_the_product() -> None:
    for name, _ in STEPS:
        assert f"| {name} |" in TEXT
    for column in COLUMNS:
        assert f"{column.title}: {' / '.join(map(str, column.shots))}" in TEXT
    last = dict(rows())[STEPS[-1][0]]
    product = PipelineSettings()
    assert last.match == product.match
    assert last.wrist == product.wrist
    assert last.binarise == product.binarise


@pytest.mark.parametrize(("name", "shape"), [(mask.MODEL, (160, 160, 3)), (SHAPE_MODEL, None)])
def test_the_model_card_says_what_goes_in(name: str, shape: tuple[int, ...] | None) -> None:
    assert f"## `{name}`" in CARD
    session = load(name)
    if shape is not None:
        (share,) = session.run(None, {"input": np.zeros(shape, np.uint8)})
        assert share.shape == (80, 80)
        assert share.dtype == np.float32
    else:
        (numbers,) = session.run(None, {"input": np.zeros((2, 1, 40, 30), np.float32)})
        assert numbers.shape == (2, 48)
        assert np.linalg.norm(numbers, axis=1) == pytest.approx(1, abs=1e-4)
