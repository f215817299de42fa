"""From the tables' rows to records, and back: times and checksums."""

import time
import uuid
import zlib
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime, timedelta

from app.errors import DatabaseBroken, Invalid
from app.gestures.records import MAX_SAMPLES, TEMPLATE_BYTES, Gesture, Sample
from app.gestures.tables import SHARED_NUMBER, GalleryRow, GestureRow, SampleRow
from app.link.actions import ACTION

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def now_ms() -> int:
    """Milliseconds since 1970, UTC."""
    return time.time_ns() // 1_000_000


def time_of(ms: int) -> datetime:
    """A time of the tables.

    Raises:
        DatabaseBroken: no such time is possible.
    """
    try:
        return EPOCH + timedelta(milliseconds=ms)
    except (OverflowError, TypeError) as error:
        raise DatabaseBroken(f"the gesture database holds an impossible time ({ms})") from error


def ms_of(time: datetime) -> int:
    """The other way round."""
    return (time - EPOCH) // timedelta(milliseconds=1)


def new_id() -> str:
    """An id that no other row has, in any database."""
    return uuid.uuid4().hex


def seal_gesture(row: GestureRow) -> None:
    """Say that a gesture's columns are as they are meant to be."""
    row.checksum = _of_gesture(row)


def seal_gallery(row: GalleryRow) -> None:
    """The same of a gallery."""
    row.checksum = _of_gallery(row)


def check_gallery(row: GalleryRow) -> None:
    """Do nothing if a gallery is as it was written.

    Raises:
        ValueError: it is not.
    """
    if row.checksum != _of_gallery(row):
        raise ValueError("wrong checksum")


def append(
    row: GestureRow,
    templates: Sequence[bytes],
    created_ms: int,
    landmarks: Sequence[bytes | None] = (),
) -> None:
    """Add samples to a gesture; ``landmarks`` is empty, or one a template.

    Raises:
        Invalid: there would be too many.
    """
    count = len(row.samples) + len(templates)
    if count > MAX_SAMPLES:
        raise Invalid(
            f"the gesture would have {count} samples; at most {MAX_SAMPLES} are allowed",
            field="templates",
        )
    known = landmarks or [None] * len(templates)
    pairs = zip(templates, known, strict=True)
    put_back(row, [(new_id(), template, created_ms, hand) for template, hand in pairs])


Kept = tuple[str, bytes, int, bytes | None]
"""A sample: id, template, time in ms since 1970, and landmarks."""


def put_back(row: GestureRow, samples: Iterable[Kept]) -> None:
    """Add samples as they were."""
    for id, template, created_ms, landmarks in samples:
        sample = SampleRow(id=id, template=template, created_ms=created_ms, landmarks=landmarks)
        sample.checksum = _of_sample(sample)
        row.samples.append(sample)


def gesture_of(row: GestureRow) -> Gesture:
    """A gesture, read back whole.

    Raises:
        ValueError, TypeError, AttributeError: it is not as it was written.
    """
    check_gallery(row.home)
    sound = row.checksum == _of_gesture(row) and all(
        sample.checksum == _of_sample(sample) and len(sample.template) == TEMPLATE_BYTES
        for sample in row.samples
    )
    if not sound:
        raise ValueError("wrong checksum")
    return Gesture(
        id=row.id,
        name=row.name,
        action=ACTION.validate_json(row.action),
        samples=tuple(
            Sample(
                sample.id,
                bytes(sample.template),
                time_of(sample.created_ms),
                None if sample.landmarks is None else bytes(sample.landmarks),
            )
            for sample in row.samples
        ),
        created=time_of(row.created_ms),
        updated=time_of(row.updated_ms),
        active=row.active,
        version=row.version,
        gallery=row.home.id,
        taught=any(sample.created_ms > row.home.created_ms for sample in row.samples),
    )


def _of_gesture(row: GestureRow) -> int:
    fields = (row.id, row.name, row.name_key, row.action, row.created_ms, row.updated_ms)
    # Added only where they say something: rows older than the columns keep their checksums.
    state = () if row.active else ("inactive",)
    version = () if row.version == 1 else (row.version,)
    gallery = () if row.gallery == SHARED_NUMBER else ("gallery", row.gallery)
    return zlib.crc32(repr(fields + state + version + gallery).encode())


def _of_sample(row: SampleRow) -> int:
    fields = (row.id, bytes(row.template), row.created_ms)
    landmarks = () if row.landmarks is None else (bytes(row.landmarks),)
    return zlib.crc32(repr(fields + landmarks).encode())


def _of_gallery(row: GalleryRow) -> int:
    return zlib.crc32(repr((row.id, row.name, row.name_key, row.created_ms)).encode())
