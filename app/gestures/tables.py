"""The gesture database's tables. A change here needs a new script in ``migrations/versions``."""

from sqlalchemy import (
    BigInteger,
    Boolean,
    ForeignKey,
    Integer,
    LargeBinary,
    String,
    Text,
    UniqueConstraint,
    true,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship


class Base(DeclarativeBase):
    """Base of all tables."""


SHARED_NUMBER = 1
"""Number of the shared gallery."""


class GalleryRow(Base):
    """One person's gestures. Times are ms since 1970, UTC."""

    __tablename__ = "galleries"

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    """Rises with every gallery made: the order in which they are listed."""
    id: Mapped[str] = mapped_column(String(32), unique=True)
    name: Mapped[str] = mapped_column(String(60))
    name_key: Mapped[str] = mapped_column(String(240), unique=True)
    created_ms: Mapped[int] = mapped_column(BigInteger)
    """Samples that are newer were taught; those that were copied are not."""
    checksum: Mapped[int] = mapped_column(BigInteger)
    """CRC-32 of the other columns."""


class GestureRow(Base):
    """One gesture. Times are ms since 1970, UTC."""

    __tablename__ = "gesture"
    __table_args__ = (UniqueConstraint("gallery", "name_key"),)

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    """Rises with every gesture made: the order in which they are listed."""
    id: Mapped[str] = mapped_column(String(32), unique=True)
    gallery: Mapped[int] = mapped_column(
        ForeignKey("galleries.number", ondelete="CASCADE"), server_default=str(SHARED_NUMBER)
    )
    name: Mapped[str] = mapped_column(String(60))
    name_key: Mapped[str] = mapped_column(String(240))
    action: Mapped[str] = mapped_column(Text)
    """JSON of :data:`app.link.actions.Action`."""
    created_ms: Mapped[int] = mapped_column(BigInteger)
    updated_ms: Mapped[int] = mapped_column(BigInteger)
    active: Mapped[bool] = mapped_column(Boolean, server_default=true())
    """Whether it is matched."""
    version: Mapped[int] = mapped_column(Integer, server_default="1")
    """Of the action: rises with each change of it."""
    checksum: Mapped[int] = mapped_column(BigInteger)
    """CRC-32 of the other columns: a damaged action must never move a robot."""
    home: Mapped[GalleryRow] = relationship(viewonly=True)
    """The gallery."""
    samples: Mapped[list["SampleRow"]] = relationship(
        order_by="SampleRow.number", cascade="all, delete-orphan", passive_deletes=True
    )
    versions: Mapped[list["ActionVersionRow"]] = relationship(
        order_by="ActionVersionRow.version", cascade="all, delete-orphan", passive_deletes=True
    )
    """The newest is the action in force."""


class ActionVersionRow(Base):
    """One action that a gesture has or had."""

    __tablename__ = "action_versions"
    __table_args__ = (UniqueConstraint("gesture", "version"),)

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    gesture: Mapped[int] = mapped_column(ForeignKey("gesture.number", ondelete="CASCADE"))
    version: Mapped[int] = mapped_column(Integer)
    action: Mapped[str] = mapped_column(Text)
    """JSON of :data:`app.link.actions.Action`."""
    created_ms: Mapped[int] = mapped_column(BigInteger)
    checksum: Mapped[int] = mapped_column(BigInteger)
    """CRC-32 of the version, the action and the time."""


class SampleRow(Base):
    """One template of a gesture."""

    __tablename__ = "sample"

    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(32), unique=True)
    gesture: Mapped[int] = mapped_column(
        ForeignKey("gesture.number", ondelete="CASCADE"), index=True
    )
    template: Mapped[bytes] = mapped_column(LargeBinary(600))
    landmarks: Mapped[bytes | None] = mapped_column(LargeBinary(254))
    """See :class:`app.gestures.records.Sample`."""
    created_ms: Mapped[int] = mapped_column(BigInteger)
    checksum: Mapped[int] = mapped_column(BigInteger)
    """CRC-32 of the other columns."""


class CounterRow(Base):
    """The one row that counts changes, so that every process notices what another one did."""

    __tablename__ = "gallery"  # there was one gallery when it was named

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(BigInteger)
