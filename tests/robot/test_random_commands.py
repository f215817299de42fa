"""A part of ``python -m benchmarks.random_commands``, with every cycle checked."""

import pytest

from benchmarks.random_commands import Fuzz


@pytest.mark.parametrize("seed", [11, 12])
def test_random_commands_break_no_limit(seed: int) -> None:
    fuzz = Fuzz(seed)
    try:
        for _ in range(1000):
            fuzz.command()
    finally:
        fuzz.close()
    assert not fuzz.broken, fuzz.examples
    assert fuzz.counts["refused at the border"] > 10
    assert fuzz.counts["obeyable"] > 500
    assert fuzz.least["itself"] < 0.09  # the arm went about
    assert 0.5 < fuzz.part["velocity"] <= 1.001
