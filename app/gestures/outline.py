"""What the galleries hold, without templates: enough to see what changed, and cheap to read."""

from typing import NamedTuple

from sqlalchemy import func, select

from app.gestures.tables import GalleryRow, GestureRow, SampleRow
from app.gestures.transactions import Transactions


class GestureOutline(NamedTuple):
    """One gesture. Two are equal while nothing about it changed."""

    name: str
    gallery: str
    """Id of the gallery."""
    version: int
    """Of the action."""
    active: bool
    samples: tuple[int, str]
    """How many there are, and the greatest of their ids, which no other samples have."""


class Outline(NamedTuple):
    """Everything, as of one moment."""

    galleries: frozenset[str]
    """Ids."""
    gestures: dict[str, GestureOutline]
    """By id."""


def outline(base: Transactions) -> Outline:
    """Read it.

    Raises:
        DatabaseBroken, WorldError: the database cannot be read.
    """
    counted = (
        select(
            GestureRow.id,
            GestureRow.name,
            GalleryRow.id,
            GestureRow.version,
            GestureRow.active,
            func.count(SampleRow.number),
            func.coalesce(func.max(SampleRow.id), ""),
        )
        .join(GalleryRow, GestureRow.gallery == GalleryRow.number)
        .join(SampleRow, SampleRow.gesture == GestureRow.number, isouter=True)
        .group_by(GestureRow.number, GalleryRow.id)
    )
    with base.read() as session:
        galleries = frozenset(session.scalars(select(GalleryRow.id)))
        gestures = {
            id: GestureOutline(name, gallery, version, active, (count, greatest))
            for id, name, gallery, version, active, count, greatest in session.execute(counted)
        }
    return Outline(galleries, gestures)
