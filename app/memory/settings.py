"""What people have chosen on the page, so that another computer finds it."""

import json
from collections.abc import Collection
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from app.memory.database import Database

MAX_PEOPLE = 200
"""Twice as many as there can be galleries; of more, the oldest changes are forgotten."""


class PersonSettings(BaseModel):
    """One person's choices; None where none was made. Nothing here moves or arms a robot."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    speed: Annotated[float, Field(ge=0.05, le=1.0)] | None = Field(
        default=None, description="part of the ordinary speed"
    )
    fine: bool | None = Field(default=None, description="a fifth of the speed, for fine work")
    large: Literal["wrist", "scene", "3d"] | None = Field(
        default=None, description="the view that is large"
    )
    glass: bool | None = Field(default=None, description="whether the glass box is open")
    language: Annotated[str, Field(pattern=r"^[a-z]{2,3}(-[A-Za-z0-9]{2,8}){0,3}$")] | None = Field(
        default=None, description="of the page's words, as BCP 47 has it"
    )
    source: Literal["camera", "synthetic", "keys"] | None = Field(
        default=None, description="by what the person drives"
    )


class SettingsStore:
    """The settings of people, by the ids of their galleries. Safe to use from any thread.

    Args:
        database: Where they are kept.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, gallery: str) -> PersonSettings:
        """What somebody has chosen so far.

        Raises:
            MemoryUnavailable: it cannot be read.
        """
        with self._database.read() as connection:
            row = connection.execute(
                "SELECT data FROM settings WHERE gallery = ?", (gallery,)
            ).fetchone()
        return _read(row)

    def change(self, gallery: str, changes: dict[str, Any], now_ms: int) -> PersonSettings:
        """Change some choices, and leave the others: the last who changes one wins.

        Args:
            gallery: Whose.
            changes: By name; None forgets a choice.
            now_ms: ms since 1970, UTC.

        Returns:
            All choices, as they are now.

        Raises:
            pydantic.ValidationError: a change is not what it should be; nothing was changed.
            StorageFull, MemoryUnavailable: nothing was changed.
        """
        with self._database.write() as connection:
            row = connection.execute(
                "SELECT data FROM settings WHERE gallery = ?", (gallery,)
            ).fetchone()
            before = _read(row).model_dump(exclude_none=True)
            changed = PersonSettings.model_validate({**before, **changes})
            connection.execute(
                "INSERT INTO settings (gallery, changed_ms, data) VALUES (?, ?, ?) "
                "ON CONFLICT (gallery) DO UPDATE "
                "SET changed_ms = excluded.changed_ms, data = excluded.data",
                (gallery, now_ms, changed.model_dump_json(exclude_none=True)),
            )
            connection.execute(
                "DELETE FROM settings WHERE gallery NOT IN "
                "(SELECT gallery FROM settings ORDER BY changed_ms DESC LIMIT ?)",
                (MAX_PEOPLE,),
            )
        return changed

    def forget(self, gallery: str) -> None:
        """Forget somebody's choices.

        Raises:
            StorageFull, MemoryUnavailable: nothing was changed.
        """
        with self._database.write() as connection:
            connection.execute("DELETE FROM settings WHERE gallery = ?", (gallery,))

    def keep_only(self, galleries: Collection[str]) -> None:
        """Forget the choices of everybody whose gallery is not among these.

        Raises:
            StorageFull, MemoryUnavailable: nothing was changed.
        """
        with self._database.write() as connection:
            known = [row[0] for row in connection.execute("SELECT gallery FROM settings")]
            gone = [(gallery,) for gallery in known if gallery not in galleries]
            connection.executemany("DELETE FROM settings WHERE gallery = ?", gone)


def _read(row: tuple[str] | None) -> PersonSettings:
    """A row; what another Farhand wrote and this one does not know counts as not chosen."""
    if row is None:
        return PersonSettings()
    known: dict[str, Any] = {}
    found = json.loads(row[0])
    for name in PersonSettings.model_fields.keys() & found.keys():
        try:
            PersonSettings.model_validate({name: found[name]})
        except ValidationError:
            continue
        known[name] = found[name]
    return PersonSettings.model_validate(known)
