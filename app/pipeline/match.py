"""PCA match: nearest enrolled template among the principal components, or unknown."""

import math
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from app.config import MatchSettings
from app.pipeline.components import principal
from app.pipeline.features import Features
from app.pipeline.gallery import Chart, Gallery, Matched
from app.pipeline.hand_landmarks.shape import HandShape, ShapeFeatures
from app.pipeline.rejection import TINY, judge, reach
from app.pipeline.types import F32, U8, Extraction, Look, Match
from app.pipeline.views import Views

__all__ = ["Chart", "Gallery", "Matched", "PcaMatcher"]

NEIGHBOURS, SHARE = 5, 0.6
"""Templates of a gesture that its distance is the mean of: the nearest ones, at most so many and at
most this part of all, since a gesture may be shown in more than one way. On webcam photographs in
other rooms the nearest alone gave 0.91 with 20 photographs enrolled, the five nearest 0.94."""
MAX_CALIBRATED = 200
"""Templates that are held against the others to calibrate; more are thinned evenly."""


class PcaMatcher:
    """Nearest neighbour in the space of the principal components (paper: eigen-gestures).

    With the features ``x`` of a view, the mean ``mu`` of the enrolled ones and the ``k`` leading
    eigenvectors ``P`` of their covariance (Turk and Pentland, "Eigenfaces for Recognition", 1991)::

        z = P^T (x - mu)                       coordinates
        e = sqrt(|x - mu|^2 - |z|^2)           reconstruction error
        d(q, g) = sqrt(|z_q - z_g|^2 + (e_q - e_g)^2) / sqrt(dimensions)

    ``d`` is the distance within the components and the difference of the distances from them: never
    more than the true distance, and equal to it when the gallery is small enough to be spanned
    whole. So one template alone works as well as hundreds. The nearest pair of views gives the
    distance to a template, and the mean over the few nearest templates that to a gesture: a gesture
    whose templates all lie near is nearer than one of which a single template happens to.

    Unknown (ours): ``d`` above the largest distance, ``e / sqrt(dimensions)`` above the largest
    error, or the second gesture nearly as near. Immutable after :meth:`fit`, so that any number of
    threads may share it.

    Attributes:
        templates: For each enrolled template its label, and its number among those of the label in
            the order of the gallery, from 0.
        chart: Where they lie.
        by_landmarks: The same for hands whose landmarks are known, where every gesture has a sample
            with landmarks; else None, and silhouettes are compared.
    """

    def __init__(self, settings: MatchSettings) -> None:
        self.settings = settings
        self.labels: tuple[str, ...] = ()
        self.templates: tuple[tuple[str, int], ...] = ()
        self.chart = Chart(np.zeros((0, 2), np.float32), np.zeros(2, np.float32))
        self.max_distance = settings.max_distance
        self.by_landmarks: PcaMatcher | None = None
        self._features = Features(settings)
        self._shape_features = ShapeFeatures(either_hand=settings.either_hand)

    @classmethod
    def fit(
        cls,
        gallery: Gallery,
        settings: MatchSettings,
        progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> Self:
        """Learn a gallery. An empty one is allowed: nothing ever matches then.

        Args:
            gallery: What is enrolled.
            settings: How to match.
            progress: Told before each template how many are learned, of how many; what it raises
                ends the work.
        """
        matcher = cls(settings)
        if gallery.labels:
            matcher._fit(gallery, progress)
        return matcher

    def used_for(self, hand: HandShape | None) -> "PcaMatcher":
        """What a hand is matched by, with landmarks or without."""
        return self if hand is None else self.best

    @property
    def best(self) -> "PcaMatcher":
        """What a hand whose landmarks are known is matched by."""
        return self.by_landmarks or self

    def _fit(self, gallery: Gallery, progress: Callable[[int, int], None]) -> None:
        order = sorted(range(len(gallery.labels)), key=lambda i: gallery.labels[i])
        labels = [gallery.labels[i] for i in order]
        first = {label: i for i, label in reversed(list(enumerate(labels)))}
        templates = [(label, i - first[label]) for i, label in enumerate(labels)]
        views = Views(self.settings)
        per_template = []
        for done, i in enumerate(order):
            progress(done, len(order))
            per_template.append(self._features(views.of_template(gallery.templates[i])))
        self._learn(templates, per_template, views.width * views.height)
        hands = [gallery.hands[i] for i in order] if gallery.hands else []
        known = [i for i, hand in enumerate(hands) if hand is not None]
        if {labels[i] for i in known} == set(labels):
            limits = {
                "max_distance": self.settings.landmark_max_distance,
                "min_reach": self.settings.landmark_min_reach,
            }
            other = self.by_landmarks = type(self)(self.settings.model_copy(update=limits))
            rows = [other._shape_features(hand) for i in known if (hand := hands[i]) is not None]
            other._learn([templates[i] for i in known], rows, 1)

    def _learn(
        self, templates: list[tuple[str, int]], per_template: list[F32], dimensions: int
    ) -> None:
        """Learn samples, sorted by label.

        Args:
            templates: Label and number of each.
            per_template: (v, d) features of each one's views.
            dimensions: The square of a distance is the features' divided by this.
        """
        self.templates = tuple(templates)
        labels = [label for label, _ in templates]
        self.labels = tuple(dict.fromkeys(labels))
        rows = np.concatenate(per_template)
        owner = np.repeat(np.arange(len(labels)), [len(part) for part in per_template])
        self._dimensions = dimensions
        self._mean: F32 = rows.mean(axis=0)
        rows -= self._mean
        self._basis = principal(rows, self.settings.components)
        self._rows = self._coordinates(rows)
        self._squares: F32 = np.einsum("ij,ij->i", self._rows, self._rows)
        of_template = np.array([self.labels.index(label) for label in labels])
        self._of_template: NDArray[np.intp] = of_template
        self._starts: NDArray[np.intp] = np.searchsorted(owner, np.arange(len(labels)))
        ends = np.searchsorted(of_template, np.arange(len(self.labels)), side="right")
        self._parts = np.split(np.arange(len(labels)), ends[:-1])
        self.chart = self._chart()
        if self.settings.calibrate:
            self.max_distance = self._calibrated(owner, of_template)

    def _chart(self) -> Chart:
        drawn = min(2, self._basis.shape[1])
        first = np.zeros((len(self._rows), 2), np.float32)
        first[:, :drawn] = self._rows[:, :drawn]
        views = np.diff(self._starts, append=len(first))
        share = np.square(first).mean(axis=0) / max(float(self._squares.mean()), TINY)
        middle = (np.add.reduceat(first, self._starts) / views[:, None]).astype(np.float32)
        return Chart(middle, share)

    def _calibrated(self, owner: NDArray[np.intp], of_template: NDArray[np.intp]) -> float:
        """The largest distance accepted; see :func:`~app.pipeline.rejection.reach`."""
        count = len(of_template)
        asked = np.unique(np.linspace(0, count - 1, min(count, MAX_CALIBRATED)).astype(np.intp))
        own_to, other_to = [], []
        for template in asked:
            to = self._to_templates(self._rows[owner == template]).min(axis=0)
            mine = of_template[template]
            others = [self._to_gesture(to[p]) for i, p in enumerate(self._parts) if i != mine]
            other_to.append(min(others, default=np.inf))
            rest = self._parts[mine][self._parts[mine] != template]
            own_to.append(self._to_gesture(to[rest]) if len(rest) else np.inf)
        return reach(np.array(own_to), np.array(other_to), self.settings)

    def _coordinates(self, centred: F32) -> F32:
        """(v, d) centred features to (v, k + 1): components, then the reconstruction error."""
        inside = centred @ self._basis
        total: F32 = np.einsum("ij,ij->i", centred, centred)
        within: F32 = np.einsum("ij,ij->i", inside, inside)
        error = np.sqrt(np.maximum(total - within, 0))
        return np.concatenate([inside, error[:, None]], axis=1)

    def _squared(self, points: F32) -> F32:
        """(v, k + 1) coordinates to (v, enrolled views) squared distances."""
        table: F32 = points @ self._rows.T
        table *= -2
        table += self._squares
        table += np.einsum("ij,ij->i", points, points)[:, None]
        np.maximum(table, 0, out=table)
        return table

    def _to_templates(self, points: F32) -> F32:
        """(v, k + 1) coordinates to (v, templates) distances, each to its nearest view."""
        nearest = np.minimum.reduceat(self._squared(points), self._starts, axis=1)
        distances: F32 = np.sqrt(nearest / self._dimensions)
        return distances

    @staticmethod
    def _to_gesture(distances: F32) -> float:
        """Distances to a gesture's templates to the distance to the gesture."""
        count = min(NEIGHBOURS, math.ceil(SHARE * len(distances)))
        return float(np.sort(distances)[:count].mean())

    def __call__(self, views: U8) -> Matched:
        """Match one hand.

        Args:
            views: (v, h, w) as :class:`~app.pipeline.views.Views` makes them.
        """
        if not self.labels:
            return Matched(None, {})
        return self._match_rows(self._features(views))

    def match_photo(self, photo: Extraction) -> Matched:
        """Match the hand in a photograph: by its landmarks where that can be, else its views."""
        matched = None if photo.hand is None else self.match_hand(photo.hand)
        return self(photo.views) if matched is None else matched

    def match_hand(self, hand: HandShape) -> Matched | None:
        """Match a hand by its landmarks; None where not every gesture has a sample with some."""
        return self.match_features(self._shape_features(hand))

    def match_features(self, features: F32) -> Matched | None:
        """The same of (v, d) features that :class:`ShapeFeatures` made with these settings."""
        if self.by_landmarks is None:
            return Matched(None, {}) if not self.labels else None
        return self.by_landmarks._match_rows(features)

    def _match_rows(self, rows: F32) -> Matched:
        return self._judge(self._coordinates(rows - self._mean), self.labels, self._parts)

    def without(self, index: int) -> Matched:
        """Match an enrolled template as if it were shown, itself left out.

        The components and the largest distance stay those of the whole gallery, so that nothing is
        fitted anew: what one template of many changes in them is little.

        Args:
            index: Of the template, in the order of :attr:`templates`.

        Returns:
            As when matching a hand; without its gesture where that has no other template.
        """
        start = self._starts[index]
        end = self._starts[index + 1] if index + 1 < len(self._starts) else len(self._rows)
        mine = self._of_template[index]
        parts = list(self._parts)
        parts[mine] = parts[mine][parts[mine] != index]
        kept = [number for number, part in enumerate(parts) if len(part)]
        if not kept:
            return Matched(None, {})
        labels = tuple(self.labels[number] for number in kept)
        return self._judge(self._rows[start:end], labels, [parts[number] for number in kept])

    def _judge(
        self, points: F32, labels: tuple[str, ...], parts: Sequence[NDArray[np.intp]]
    ) -> Matched:
        """(v, k + 1) coordinates against the templates in ``parts``, one part a label."""
        table = self._to_templates(points)
        nearest = table.min(axis=0)
        per_label = np.array([self._to_gesture(nearest[part]) for part in parts])
        distances = dict(zip(labels, per_label.tolist(), strict=True))
        best = int(per_label.argmin())
        distance = distances[labels[best]]
        margin: float | None = None
        second: str | None = None
        if len(labels) > 1:
            others = per_label.copy()
            others[best] = np.inf
            runner_up = int(others.argmin())
            second = labels[runner_up]
            margin = distances[second] - distance
        best_view = int(table[:, parts[best]].min(axis=1).argmin())
        error = float(points[best_view, -1]) / float(np.sqrt(self._dimensions))
        strangeness, cause, reason = judge(
            (labels[best], second), distance, self.max_distance, margin, error, self.settings
        )
        match = Match(
            labels[best], distance, margin, error, cause is None, reason, strangeness, cause
        )
        return Matched(match, distances, Look(points[best_view], nearest, second))

    def match_template(self, template: U8) -> Matched:
        """Match an (80, 60) template of which nothing else is known."""
        return self(Views(self.settings).of_template(template))
