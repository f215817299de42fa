"""Enrolment: images to templates, with what is wrong with them and what they may be confused with.

Every image is a piece of its own for the processes (:mod:`app.gateway.work_pool`), so that uploads
take turns, and one whose client is gone ends after the image that is under way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.config import PipelineSettings
from app.errors import ImageRefused, Invalid
from app.gestures import Gesture
from app.pipeline import pack_template, unpack_template
from app.pipeline.burst import Look, choose, look_at, see
from app.pipeline.confusion import Comparison, Confusion, compare
from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.quality import Finding
from app.pipeline.types import U8

if TYPE_CHECKING:
    from app.gateway.hub import Hub


Set = tuple[str, U8]
"""Name and (n, 80, 60) templates of a gesture."""


@dataclass(frozen=True)
class Judged:
    """The images of an upload, judged.

    Attributes:
        looks: One an image.
        kept: Indices of those to enrol.
        left_out: How many were left out for each reason.
    """

    looks: tuple[Look, ...]
    kept: tuple[int, ...]
    left_out: dict[str, int]

    @property
    def templates(self) -> list[bytes]:
        """What is to be enrolled, 600 bytes each."""
        return [pack_template(template) for template, _ in self._samples()]

    @property
    def landmarks(self) -> list[bytes | None]:
        """Of each of these, 254 bytes; None where they are not known."""
        return [None if hand is None else hand.pack() for _, hand in self._samples()]

    def _samples(self) -> list[tuple[U8, HandShape | None]]:
        looks = (self.looks[number] for number in self.kept)
        return [(look.template, look.hand) for look in looks if look.template is not None]

    def images_json(self) -> list[dict[str, Any]]:
        """The verdict on each image, as docs/protocol.md shows it."""
        return [
            {
                "image": number,
                "accepted": look.problem is None,
                "problem": None if look.problem is None else look.problem.code,
                "reason": None if look.problem is None else look.problem.message,
                "advice": _findings(look.advice),
            }
            for number, look in enumerate(self.looks, start=1)
        ]

    def burst_json(self) -> dict[str, Any]:
        """What a burst came to."""
        return {
            "images": len(self.looks),
            "kept": [number + 1 for number in self.kept],
            "left_out": self.left_out,
        }


async def judge(hub: "Hub", images: Sequence[bytes], *, burst: bool) -> Judged:
    """Judge the images of an upload, none of which stops the others.

    Raises:
        Invalid: no image.
    """
    if not images:
        raise Invalid("at least one image is needed in 'images'", field="images")
    settings = hub.settings.pipeline
    looks = [await hub.pictures.run(look_at, image, settings) for image in images]
    if burst:
        chosen = await hub.pictures.run(choose, looks, settings)
        return Judged(chosen.looks, chosen.kept, chosen.left_out)
    return _all_good(looks)


async def judge_for_enrolment(hub: "Hub", images: Sequence[bytes], *, burst: bool) -> Judged:
    """The same, where an image that is refused refuses all, but for a burst.

    Raises:
        Invalid: no image.
        ImageRefused: an image is refused; or no frame of the burst is good.
        TooLarge: an image has too many bytes.
    """
    if not burst:
        if not images:
            raise Invalid("at least one image is needed in 'images'", field="images")
        looks = []
        for number, image in enumerate(images, start=1):
            try:
                looks.append(await hub.pictures.run(see, image, hub.settings.pipeline))
            except ImageRefused as error:
                error.detail["image"] = number
                if len(images) > 1:
                    error.message = f"image {number}: {error.message}"
                raise
        return _all_good(looks)
    judged = await judge(hub, images, burst=True)
    if not judged.kept:
        counts = ", ".join(f"{count} {_words(code)}" for code, count in judged.left_out.items())
        raise ImageRefused(
            f"none of the {len(images)} images of the burst can be enrolled: {counts}",
            images=len(images),
            left_out=judged.left_out,
        )
    return judged


def _all_good(looks: Sequence[Look]) -> Judged:
    kept = tuple(number for number, look in enumerate(looks) if look.problem is None)
    left_out: dict[str, int] = {}
    for look in looks:
        if look.problem is not None:
            left_out[look.problem.code] = left_out.get(look.problem.code, 0) + 1
    return Judged(tuple(looks), kept, left_out)


def _words(code: str) -> str:
    return {
        "another_gesture": "without a sign that most of them show",
        "no_hand": "without a hand",
        "no_wrist": "without a wrist",
        "two_hands": "with two hands",
    }.get(code, code.replace("_", " "))


def confusions_json(
    gestures: Sequence[Gesture],
    settings: PipelineSettings,
    threshold: float,
    name: str,
    templates: Sequence[bytes],
    besides: str | None = None,
) -> list[dict[str, Any]]:
    """What a gesture may be confused with; takes a while.

    Args:
        gestures: All that are enrolled.
        settings: Of the pipeline.
        threshold: Largest distance at which a match is accepted.
        name: Of the gesture.
        templates: All its samples, 600 bytes each.
        besides: Id of the same gesture where it is enrolled already.
    """
    others = [gesture for gesture in gestures if gesture.id != besides]
    if not templates or not others:
        return []
    found = compare(sets_of(name, templates, others), settings.match, threshold, asked=[0])
    return found_json(found, others, threshold)


def sets_of(name: str, templates: Sequence[bytes], others: Sequence[Gesture]) -> list[Set]:
    """What :func:`~app.pipeline.confusion.compare` takes: a gesture, then the others."""
    return [_stacked(name, templates)] + [set_of(gesture) for gesture in others]


def found_json(
    found: Comparison, others: Sequence[Gesture], threshold: float
) -> list[dict[str, Any]]:
    """What the first of :func:`sets_of` may be confused with."""
    return [_confusion_json(one, others[one.other - 1], threshold) for one in found.confusions]


def matrix_json(found: Comparison, gestures: Sequence[Gesture], threshold: float) -> dict[str, Any]:
    """All gestures against all others, as the page draws it."""
    return {
        "threshold": threshold,
        "gestures": [
            {
                "id": gesture.id,
                "name": gesture.name,
                "active": gesture.active,
                "samples": len(gesture.samples),
                "own": _number(own),
            }
            for gesture, own in zip(gestures, found.own.tolist(), strict=True)
        ],
        "distances": [[_number(value) for value in row] for row in found.distance.tolist()],
        "confusions": [
            {
                "shown": gestures[one.gesture].name,
                **_confusion_json(one, gestures[one.other], threshold),
            }
            for one in found.confusions
        ],
    }


def set_of(gesture: Gesture) -> Set:
    """A gesture as :func:`~app.pipeline.confusion.compare` takes it."""
    return _stacked(gesture.name, [sample.template for sample in gesture.samples])


def _stacked(name: str, templates: Sequence[bytes]) -> Set:
    return name, np.stack([unpack_template(template) for template in templates])


def _confusion_json(one: Confusion, other: Gesture, threshold: float) -> dict[str, Any]:
    margin = None if one.own is None else one.distance - one.own
    return {
        "gesture": other.name,
        "id": other.id,
        "active": other.active,
        "level": one.level,
        "strength": round(one.strength, 3),
        "distance": _number(one.distance),
        "own": _number(one.own),
        "margin": _number(margin),
        "threshold": threshold,
        "advice": _findings(one.advice),
    }


def _findings(findings: Sequence[Finding]) -> list[dict[str, str]]:
    return [{"code": one.code, "message": one.message} for one in findings]


def _number(value: float | None) -> float | None:
    """A number for JSON, which knows neither NaN nor infinity."""
    return None if value is None or not np.isfinite(value) else round(value, 4)
