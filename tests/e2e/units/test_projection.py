"""The plot of the gallery in the glass box."""

import pytest
from playwright.sync_api import Page

from tests.e2e.running import run


def test_templates_are_plotted_at_one_scale_and_the_hand_never_leaves_the_plot(
    modules: Page,
) -> None:
    script = (
        "const place = m.placer([[0, 0], [40, 10]], 212, 112);"
        "return [[0, 0], [40, 10], [20, 5], [20, 10], [999, -999]].map(place)"
    )
    low, high, middle, above, far = run(modules, "ui/glass/projection.js", script)
    assert middle == [106, 56]
    assert low[0] == pytest.approx(12)
    assert high[0] == pytest.approx(200)
    assert high[1] < middle[1] < low[1], "up is up"
    assert (middle[1] - above[1]) / (high[0] - middle[0]) == pytest.approx(5 / 20)
    assert far == [206, 106]
