import json
from dataclasses import asdict

import numpy as np
import pytest

from app.config import MatchSettings
from app.errors import Invalid
from app.pipeline import Gallery, PcaMatcher
from app.pipeline.features import Features
from app.pipeline.match import Matched
from app.pipeline.palm import PalmFinder
from app.pipeline.views import Views
from tests.pipeline.drawing import draw_mask, gallery

SETTINGS = MatchSettings()
PAPER = MatchSettings(features="binary", turns=(0.0,), cuts=(), trims=(0.0,))
ONE_VIEW = PAPER.model_copy(update={"shears": ()})
GALLERY = gallery()


def views(shape: str, settings: MatchSettings = SETTINGS, **kw):
    return Views(settings)(PalmFinder()(draw_mask(shape, size=(320, 240), **kw)))


@pytest.mark.parametrize("settings", [SETTINGS, PAPER], ids=["product", "paper"])
def test_enrolled_template_is_its_own_nearest(settings):
    matcher = PcaMatcher.fit(GALLERY, settings)
    for label, template in zip(GALLERY.labels, GALLERY.templates, strict=True):
        matched = matcher.match_template(template)
        assert matched.match is not None
        assert matched.match.gesture == label
        assert matched.match.distance == pytest.approx(0, abs=5e-3)
        assert matched.match.accepted
        assert set(matched.distances) == set(GALLERY.labels)


@pytest.mark.parametrize("shape", GALLERY.labels)
@pytest.mark.parametrize("change", [{"shift": (20, 10)}, {"scale": 0.8}])
def test_same_shape_elsewhere_is_recognised(shape, change):
    match = PcaMatcher.fit(GALLERY, SETTINGS)(views(shape, **change)).match
    assert match is not None
    assert (match.gesture, match.accepted) == (shape, True)


def test_empty_gallery_never_matches():
    assert PcaMatcher.fit(Gallery.empty(), SETTINGS)(views("one")) == Matched(None, {})


@pytest.mark.parametrize("settings", [SETTINGS, PAPER], ids=["product", "paper"])
def test_one_template_is_enough(settings):
    one = Gallery(("one",), GALLERY.templates[1:2])
    matcher = PcaMatcher.fit(one, settings)
    same = matcher.match_template(one.templates[0]).match
    assert same is not None
    assert same.accepted
    assert same.margin is None
    other = matcher.match_template(GALLERY.templates[3]).match
    assert other is not None
    assert not other.accepted
    json.dumps(asdict(other), allow_nan=False)


def test_one_label_with_several_templates_has_no_margin():
    two = Gallery(("one", "one"), np.stack([GALLERY.templates[1]] * 2))
    match = PcaMatcher.fit(two, SETTINGS)(views("one")).match
    assert match is not None
    assert match.margin is None
    assert match.accepted


def test_reasons_are_plain_sentences():
    def reason(**kw):
        settings = MatchSettings(calibrate=False, **kw)
        match = PcaMatcher.fit(GALLERY, settings)(views("two", settings, scale=0.7)).match
        assert match is not None
        assert not match.accepted
        return match.reason

    far = reason(max_distance=0.0)
    assert far.startswith("unknown hand: closest is two, but too far (0.")
    assert far.endswith(", at most 0.00)")
    assert reason(max_distance=2, max_error=0.0).startswith(
        "unknown hand: closest is two, but the shape is unlike any enrolled one (0."
    )
    assert reason(max_distance=2, max_error=2, min_margin=2).startswith("undecided: two and ")


def test_blobs_are_unknown():
    matcher = PcaMatcher.fit(gallery(("two", "five")), SETTINGS)
    full = matcher.match_template(np.ones((80, 60), np.uint8)).match
    assert full is not None
    assert not full.accepted


def test_order_of_enrolment_does_not_matter():
    turned = Gallery(GALLERY.labels[::-1], GALLERY.templates[::-1])
    one = PcaMatcher.fit(GALLERY, SETTINGS)(views("two"))
    other = PcaMatcher.fit(turned, SETTINGS)(views("two"))
    assert one.distances == pytest.approx(other.distances, abs=1e-4)


def test_more_samples_lie_nearer():
    far = PcaMatcher.fit(GALLERY, SETTINGS)(views("two", scale=0.6)).distances["two"]
    extra = [gallery(("two",), scale=scale) for scale in (0.58, 0.6, 0.62)]
    both = Gallery(
        GALLERY.labels + sum((g.labels for g in extra), ()),
        np.concatenate([GALLERY.templates, *(g.templates for g in extra)]),
    )
    assert PcaMatcher.fit(both, SETTINGS)(views("two", scale=0.6)).distances["two"] <= far + 1e-3


def test_a_look_tells_how_far_each_template_is_and_which_sample_of_which_gesture_it_is():
    extra = gallery(("two",), scale=0.6)
    both = Gallery(
        (*extra.labels, *GALLERY.labels), np.stack([*extra.templates, *GALLERY.templates])
    )
    matcher = PcaMatcher.fit(both, SETTINGS)
    assert len(matcher.templates) == len(GALLERY.labels) + 1
    assert [sample for label, sample in matcher.templates if label == "two"] == [0, 1]
    # The sample that was enrolled first has number 0.
    for sample, template in enumerate((extra.templates[0], GALLERY.templates[2])):
        matched = matcher.match_template(template)
        assert matched.look is not None
        assert matched.match is not None
        nearest = int(matched.look.distances.argmin())
        assert matcher.templates[nearest] == ("two", sample)
        assert matched.look.distances[nearest] == pytest.approx(0, abs=5e-3)
        others = {k: v for k, v in matched.distances.items() if k != "two"}
        assert matched.look.second == min(others, key=others.__getitem__)
    one = PcaMatcher.fit(Gallery(("one",), GALLERY.templates[1:2]), SETTINGS)
    look = one.match_template(GALLERY.templates[1]).look
    assert look is not None
    assert look.second is None


@pytest.mark.parametrize("settings", [SETTINGS, ONE_VIEW], ids=["product", "one view"])
def test_a_chart_shows_where_the_templates_lie(settings):
    matcher = PcaMatcher.fit(GALLERY, settings)
    assert matcher.chart.at.shape == (len(GALLERY.labels), 2)
    first, second = matcher.chart.share
    assert 1 > first >= second > 0
    if settings is ONE_VIEW:
        # The template itself, whose point is exact.
        for row, label in enumerate(matcher.labels):
            template = GALLERY.templates[GALLERY.labels.index(label)]
            look = matcher.match_template(template).look
            assert look is not None
            assert look.point[:2] == pytest.approx(matcher.chart.at[row], abs=1e-2)


def test_a_gallery_too_small_for_two_axes_has_a_chart_all_the_same():
    assert PcaMatcher.fit(Gallery.empty(), ONE_VIEW).chart.at.shape == (0, 2)
    two = PcaMatcher.fit(Gallery(("a", "b"), GALLERY.templates[:2]), ONE_VIEW)
    assert two.chart.share == pytest.approx([1, 0], abs=1e-3)
    assert two.chart.at[:, 1] == pytest.approx(0)


def test_wrong_shapes_are_refused():
    with pytest.raises(Invalid, match=r"^templates of shape \(1, 60, 80\) where \(1, 80, 60\)"):
        Gallery(("a",), np.zeros((1, 60, 80), np.uint8))


def test_views_vary_turn_and_cut():
    made = views("five", MatchSettings(turns=(-0.2, 0.0, 0.2), cuts=(1.0, 1.3, 1.7)))
    assert made.shape == (9, 40, 30)
    assert len({view.tobytes() for view in made}) == 9
    assert len(views("five")) == len(SETTINGS.turns) * len(SETTINGS.cuts)
    assert views("five", PAPER).shape == (1, 80, 60)


def test_views_of_an_empty_template():
    assert Views(SETTINGS).of_template(np.zeros((80, 60), np.uint8)).shape == (1, 40, 30)
    matched = PcaMatcher.fit(GALLERY, SETTINGS).match_template(np.zeros((80, 60), np.uint8))
    assert matched.match is not None
    assert not matched.match.accepted


def test_distance_features_are_signed_and_squashed():
    view = np.zeros((1, 40, 30), np.uint8)
    view[0, 10:30, 8:22] = 1
    features = Features(MatchSettings(features="distance"))(view).reshape(40, 30)
    assert features[20, 15] > 0.8
    assert features[0, 0] < -0.8
    assert np.all((features > 0) == (view[0] == 1))
    assert np.abs(features).max() <= 1


def test_binary_features_are_the_pixels():
    view = np.eye(80, 60, dtype=np.uint8)[None]
    assert np.array_equal(Features(PAPER)(view)[0], view.ravel() * 2.0 - 1)


def test_strangeness_is_at_most_one_exactly_when_accepted():
    matcher = PcaMatcher.fit(GALLERY, SETTINGS)
    for shape in GALLERY.labels:
        for scale in (0.5, 0.8, 1.2):
            for side in ("bottom", "left"):
                match = matcher(views(shape, scale=scale, side=side)).match
                assert match is not None
                assert (match.strangeness <= 1) == match.accepted
    narrow = SETTINGS.model_copy(update={"max_distance": 0.0, "min_reach": 0.0})
    match = PcaMatcher.fit(GALLERY, narrow)(views("one", scale=0.6)).match
    assert match is not None
    assert match.strangeness > 1
    json.dumps(asdict(match), allow_nan=False)


def test_shape_features_are_the_distance_ones_and_numbers_of_one_length():
    views = np.zeros((2, 40, 30), np.uint8)
    views[0, 10:30, 8:22] = 1
    views[1, 5:38, 12:18] = 1
    rows = Features(SETTINGS)(views)
    outlines = Features(MatchSettings(features="distance"))(views)
    assert np.array_equal(rows[:, :1200], outlines)
    lengths = np.linalg.norm(rows[:, 1200:], axis=1)
    assert np.allclose(lengths, SETTINGS.shape_weight * np.sqrt(1200), rtol=1e-3)


def test_a_thumb_that_was_parted_from_the_hand_counts_as_enrolled():
    template = np.zeros((80, 60), np.uint8)
    template[:, 5:40] = 1
    template[60:, 48:58] = 1
    views = Views(SETTINGS).of_template(template)
    assert views[len(SETTINGS.turns) // 2][35, 26] == 1
