"""What the gesture database holds, as plain immutable records, and the rules for their values."""

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from app.errors import Invalid
from app.link.actions import Action

TEMPLATE_WIDTH = 60
TEMPLATE_HEIGHT = 80
TEMPLATE_BYTES = TEMPLATE_WIDTH * TEMPLATE_HEIGHT // 8
"""600 bytes: 80 rows of 60 pixels, one bit a pixel, row after row, first pixel in the highest bit
(the order of :func:`numpy.packbits`). 1 is the hand."""
LANDMARK_BYTES, LANDMARK_FORMAT = 254, 1
"""21 points of the hand, in the picture and in metres, as the pipeline packs them; the first byte
is the format. The database does not look into them."""
NAME_MAX = 60
"""Characters of a gesture's name."""
MAX_GESTURES = 500
"""Gestures of one gallery."""
MAX_SAMPLES = 1000
"""Samples of one gesture."""
MAX_GALLERIES = 100
"""The shared one included."""
SHARED = "shared"
"""Id of the gallery that is always there."""
MAX_VERSIONS = 100
"""Actions of one gesture that are kept; the oldest are forgotten."""

_JOINERS = "\u200c\u200d"
"""Not printable by Unicode's book, but part of Persian words and of many emoji."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One enrolled picture of a gesture, as its template."""

    id: str
    template: bytes
    """600 bytes, see :data:`TEMPLATE_BYTES`."""
    created: datetime
    """UTC, in steps of a millisecond."""
    landmarks: bytes | None = None
    """Of the hand, :data:`LANDMARK_BYTES`; None where they are not known."""


@dataclass(frozen=True, slots=True)
class Gesture:
    """A name, what it makes the robot do, and what it looks like."""

    id: str
    name: str
    action: Action
    samples: tuple[Sample, ...]
    """In the order in which they were enrolled; at least one."""
    created: datetime
    updated: datetime
    """UTC, in steps of a millisecond."""
    active: bool = True
    """Whether it is matched. An inactive gesture is kept and listed, and moves nothing."""
    version: int = 1
    """Of the action: rises with each change of it."""
    gallery: str = SHARED
    """Id of the gallery that it belongs to."""
    taught: bool = False
    """Whether a sample of it is newer than its gallery: shown by its person, not copied."""


@dataclass(frozen=True, slots=True)
class Gallery:
    """One person's gestures; the one whose id is :data:`SHARED` is everybody's."""

    id: str
    name: str
    created: datetime
    """UTC, in steps of a millisecond."""
    gestures: int
    taught: int
    """How many of the gestures are :attr:`Gesture.taught`."""


@dataclass(frozen=True, slots=True)
class ActionVersion:
    """An action that a gesture has or had."""

    version: int
    action: Action
    created: datetime
    """UTC, in steps of a millisecond."""


def clean_name(name: str, what: str = "gesture") -> str:
    """The form in which a name is kept: Unicode NFC, without white space at its ends.

    Args:
        name: As it was given.
        what: Whose name it is to be, for the message.

    Raises:
        Invalid: empty, longer than 60 characters, or with characters that cannot be seen.
    """
    clean = unicodedata.normalize("NFC", name).strip()
    if not clean:
        raise Invalid(f"a {what} needs a name: 1 to 60 characters", field="name", given=name)
    if len(clean) > NAME_MAX:
        raise Invalid(
            f"the name has {len(clean)} characters; at most {NAME_MAX} are allowed",
            field="name",
            length=len(clean),
        )
    for character in clean:
        if not character.isprintable() and character not in _JOINERS:
            raise Invalid(
                f"the name holds the character U+{ord(character):04X}, which cannot be printed; "
                "use letters, digits, signs and spaces",
                field="name",
                character=f"U+{ord(character):04X}",
            )
    if not any(unicodedata.category(character)[0] in "LNPS" for character in clean):
        raise Invalid("the name holds nothing that can be seen", field="name")
    return clean


def name_key(name: str) -> str:
    """What two names are compared by: equal keys count as the same name (``Up`` and ``UP``)."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def check_templates(templates: Sequence[bytes]) -> tuple[bytes, ...]:
    """The templates as a tuple, once each of them is known to be one.

    Raises:
        Invalid: none given, a wrong length, or a template that is empty or full.
    """
    if not templates:
        raise Invalid("a gesture needs at least one picture", field="templates")
    if len(templates) > MAX_SAMPLES:
        raise Invalid(
            f"{len(templates)} samples given; a gesture may have {MAX_SAMPLES}", field="templates"
        )
    for number, template in enumerate(templates, start=1):
        if len(template) != TEMPLATE_BYTES:
            raise Invalid(
                f"template {number} has {len(template)} bytes; 60x80 pixels, one bit each, are "
                f"{TEMPLATE_BYTES}",
                field="templates",
                length=len(template),
            )
        if not any(template) or all(byte == 0xFF for byte in template):
            raise Invalid(
                f"template {number} is one colour all over; it shows no hand", field="templates"
            )
    return tuple(bytes(template) for template in templates)


def check_landmarks(
    landmarks: Sequence[bytes | None], templates: Sequence[bytes]
) -> tuple[bytes | None, ...]:
    """The landmarks as a tuple, one a template, once each is known to be some.

    Raises:
        Invalid: not one a template, or not what the pipeline packs.
    """
    if not landmarks:
        return ()
    if len(landmarks) != len(templates):
        raise Invalid(
            f"{len(landmarks)} landmarks for {len(templates)} templates", field="landmarks"
        )
    for number, packed in enumerate(landmarks, start=1):
        if packed is not None and (len(packed) != LANDMARK_BYTES or packed[0] != LANDMARK_FORMAT):
            raise Invalid(
                f"landmarks {number} have {len(packed)} bytes; {LANDMARK_BYTES} are needed, "
                f"the first of them {LANDMARK_FORMAT}",
                field="landmarks",
            )
    if all(packed is None for packed in landmarks):
        return ()
    return tuple(None if packed is None else bytes(packed) for packed in landmarks)


@dataclass(frozen=True, slots=True)
class NewGesture:
    """A gesture that is not in a database yet, such as one read from an exchange folder."""

    name: str
    action: Action
    templates: tuple[bytes, ...]
    active: bool = True
    landmarks: tuple[bytes | None, ...] = ()
    """Of each template; empty where none has any."""


def checked_entry(entry: NewGesture) -> NewGesture:
    """A gesture with the name as it is kept, and sound samples.

    Raises:
        Invalid: the name, a template or landmarks are not what they should be.
    """
    return NewGesture(
        clean_name(entry.name),
        entry.action,
        check_templates(entry.templates),
        entry.active,
        check_landmarks(entry.landmarks, entry.templates),
    )
