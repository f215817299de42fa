"""The actions that a gesture had: each change is a new version, the former ones are kept."""

import zlib
from collections.abc import Sequence
from typing import NamedTuple

from pydantic import ValidationError

from app.errors import ChangedMeanwhile
from app.gestures.records import MAX_VERSIONS
from app.gestures.tables import ActionVersionRow, GestureRow
from app.link.actions import ACTION, Action


class Kept(NamedTuple):
    """One version, read back."""

    version: int
    action: Action
    created_ms: int


def keep(row: GestureRow, versions: Sequence[Kept]) -> None:
    """Give a new row the versions that its gesture had; the newest is in force."""
    for version, action, created_ms in versions:
        _append(row, version, ACTION.dump_json(action).decode(), created_ms)


def set_action(row: GestureRow, action: Action, now_ms: int) -> None:
    """Make ``action`` the gesture's newest version; the same action again is no new one."""
    if row.versions and _says(row.action, action):
        return
    text = ACTION.dump_json(action).decode()
    _append(row, row.version + 1, text, now_ms)
    del row.versions[:-MAX_VERSIONS]


def _append(row: GestureRow, version: int, text: str, created_ms: int) -> None:
    row.action, row.version = text, version
    kept = ActionVersionRow(version=version, action=text, created_ms=created_ms)
    kept.checksum = _checksum(kept)
    row.versions.append(kept)


def check_version(row: GestureRow, version: int | None) -> None:
    """Refuse a change that was made without knowing the newest version; None knows none.

    Raises:
        ChangedMeanwhile: ``version`` is not the newest.
    """
    if version is not None and version != row.version:
        raise ChangedMeanwhile(
            f"the action of {row.name} was changed meanwhile: its newest version is {row.version}, "
            f"not {version}; look at it and change it again",
            newest=row.version,
            given=version,
        )


def version_of(row: ActionVersionRow) -> Kept:
    """One version, read back.

    Raises:
        ValueError: its content has changed on the disk.
    """
    if row.checksum != _checksum(row):
        raise ValueError("wrong checksum")
    return Kept(row.version, ACTION.validate_json(row.action), row.created_ms)


def _says(text: str, action: Action) -> bool:
    # As actions: a text written before an action had all its fields says the same without them.
    try:
        return ACTION.validate_json(text) == action
    except ValidationError:
        return False


def _checksum(row: ActionVersionRow) -> int:
    return zlib.crc32(repr((row.version, row.action, row.created_ms)).encode())
