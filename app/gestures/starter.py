"""The starter set: ten gestures with their actions, drawn by the project's own hand."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid
from app.gestures.hand.pose import jitter
from app.gestures.hand.poses import ALSO, POSES
from app.gestures.hand.render import HandLook, HandView, render_hand
from app.gestures.hand.skin import TONES
from app.gestures.records import TEMPLATE_HEIGHT, TEMPLATE_WIDTH, NewGesture, check_landmarks
from app.gestures.setwriter import write_set
from app.link.actions import Action, Gripper, Home, JogCartesian, Stop

Extract = Callable[[bytes], tuple[NDArray[np.uint8], bytes | None]]
"""Gives the template, shape (80, 60), 0 and 1, of an image file's bytes, and the packed landmarks:
the pipeline's part."""

SPEED = 0.10
"""m/s of the six moves."""
ACTIONS: dict[str, Action] = {
    "forward": JogCartesian(frame="base", linear=(SPEED, 0.0, 0.0)),
    "back": JogCartesian(frame="base", linear=(-SPEED, 0.0, 0.0)),
    "left": JogCartesian(frame="base", linear=(0.0, SPEED, 0.0)),
    "right": JogCartesian(frame="base", linear=(0.0, -SPEED, 0.0)),
    "up": JogCartesian(frame="base", linear=(0.0, 0.0, SPEED)),
    "down": JogCartesian(frame="base", linear=(0.0, 0.0, -SPEED)),
    "open": Gripper(width=0.08),
    "close": Gripper(width=0.0),
    "home": Home(),
    "stop": Stop(),
}
"""What each starter gesture does: six moves in an exact direction, gripper, home, stop."""


@dataclass(frozen=True, slots=True)
class _Variant:
    """How one sample differs from the plain pose."""

    turn: float = 0.0
    length: float = 270.0
    jitter: float = 0.0
    skin: str = "medium"


VARIANTS = (
    _Variant(),
    _Variant(turn=-0.12),
    _Variant(turn=0.12),
    _Variant(length=225.0, jitter=0.04),
    _Variant(length=315.0, jitter=0.04, skin="tan"),
    _Variant(turn=-0.06, jitter=0.06, skin="light"),
    _Variant(turn=0.06, jitter=0.06),
)
"""One sample each: small turns, sizes, and what differs between people. The matcher itself tries
larger turns."""


def starter_pictures(name: str) -> list[NDArray[np.uint8]]:
    """The pictures of a gesture that its samples are made of, 640x480 BGR; always the same."""
    generator = np.random.default_rng(list(ACTIONS).index(name))
    shown = [(POSES[name], variant) for variant in VARIANTS]
    shown += [(pose, variant) for pose in ALSO.get(name, ()) for variant in VARIANTS[:3]]
    pictures = []
    for pose, variant in shown:
        view = HandView(variant.length, turn=variant.turn)
        look = HandLook(skin=TONES[variant.skin])
        varied = jitter(pose, variant.jitter, generator)
        pictures.append(render_hand(varied, view=view, look=look))
    return pictures


def starter_set(extract: Extract) -> list[NewGesture]:
    """Draw the ten gestures and take their templates.

    Raises:
        Invalid: ``extract`` gives something that is not a template.
    """
    gestures = []
    for name, action in ACTIONS.items():
        templates, landmarks = [], []
        for picture in starter_pictures(name):
            done, data = cv2.imencode(".png", picture)
            assert done
            template, hand = extract(data.tobytes())
            if template.shape != (TEMPLATE_HEIGHT, TEMPLATE_WIDTH) or template.max() > 1:
                raise Invalid(
                    f"a template has the shape (80, 60) and holds 0 and 1; got {template.shape}, "
                    f"up to {template.max()}"
                )
            templates.append(np.packbits(template.astype(np.uint8)).tobytes())
            landmarks.append(hand)
        hands = check_landmarks(landmarks, templates)
        gestures.append(NewGesture(name, action, tuple(templates), landmarks=hands))
    return gestures


def draw_starter_set(target: Path, extract: Extract) -> list[NewGesture]:
    """Write the starter set to a new folder, or to a zip file, in the exchange format.

    Raises:
        Invalid: the target exists and is not an empty folder.
    """
    gestures = starter_set(extract)
    write_set(gestures, target)
    return gestures
