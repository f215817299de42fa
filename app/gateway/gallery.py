"""The gesture database as the sessions need it: a fitted matcher, and the action of each name."""

import logging
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError

from app.config import PipelineSettings, Settings
from app.errors import CannotStart
from app.gestures import GestureStore
from app.gestures.backup import Place
from app.gestures.recovery import Hold, check_there, open_or_set_aside
from app.link.actions import Action
from app.pipeline import Gallery, PcaMatcher, unpack_template
from app.robot.models import load_model

log = logging.getLogger(__name__)

DATABASE_FILE = "gestures.db"
BACKUPS = "backups"


def starter_set() -> Path | None:
    """The folder of the starter set: inside the wheel, or beside the package in a checkout."""
    package = Path(__file__).parents[1]
    for folder in (package / "gesture_db", package.parent / "gesture_db"):
        if (folder / "gestures.toml").is_file():
            return folder
    return None


def open_store(settings: Settings) -> GestureStore:
    """Open the database of ``settings``; a new one is filled with the starter set.

    What its gestures do may be different for a robot: see ``starter`` in its profile.

    Raises:
        DatabaseBroken: it cannot be read, or is gone although there are backups.
        CannotStart: the folder cannot be made or written, or the robot's profile is wrong.
    """
    url = settings.database_url
    if url is None:
        try:
            settings.data_dir.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CannotStart(
                f"the data folder {settings.data_dir} cannot be made ({error.strerror}); "
                "choose another with --data-dir",
                path=str(settings.data_dir),
            ) from error
        url = f"sqlite:///{settings.data_dir.absolute() / DATABASE_FILE}"
    place = place_of(settings)
    if place is not None:
        check_there(place)
    profile = settings.robot.profile
    actions = load_model(profile).starter if profile is not None else {}
    return GestureStore(url, starter_set(), actions)


def place_of(settings: Settings) -> Place | None:
    """Where the database and its backups are; None when it is not SQLite's."""
    database = settings.data_dir.absolute() / DATABASE_FILE
    if settings.database_url is not None:
        try:
            url = make_url(settings.database_url)
        except ArgumentError:
            return None  # opening it says what is wrong
        if url.get_backend_name() != "sqlite" or not url.database:
            return None
        database = Path(url.database).absolute()
    return Place(database, settings.data_dir.absolute() / BACKUPS)


def open_for_server(settings: Settings) -> tuple[GestureStore, Hold | None]:
    """Open the database for as long as a server runs; one that is broken is set aside.

    Returns:
        The store, and what to close after it.

    Raises:
        DatabaseBroken: it is broken, and another server has it open.
        ForeignDatabase, CannotStart, StorageFull, WorldError: as :func:`open_store`.
    """
    place = place_of(settings)
    if place is None:
        return open_store(settings), None
    hold = Hold(place)
    try:
        return open_or_set_aside(place, hold, lambda: open_store(settings)), hold
    except BaseException:
        hold.close()
        raise


def fit(templates: Sequence[tuple[str, bytes]], settings: PipelineSettings) -> PcaMatcher:
    """A matcher for (name, 600 bytes) pairs."""
    images = [unpack_template(template) for _, template in templates]
    stacked = np.stack(images) if images else np.zeros((0, 80, 60), np.uint8)
    gallery = Gallery(labels=tuple(name for name, _ in templates), templates=stacked)
    return PcaMatcher.fit(gallery, settings.match)


def build_matcher(store: GestureStore, settings: PipelineSettings) -> PcaMatcher:
    """A matcher for everything that is enrolled now."""
    return fit(store.templates(), settings)


@dataclass(frozen=True)
class Enrolled:
    """What was enrolled at one moment. Immutable, so that sessions may share it."""

    version: int
    matcher: PcaMatcher
    actions: dict[str, Action] = field(default_factory=dict)
    """By the active gesture's name."""
    ids: dict[str, str] = field(default_factory=dict)
    """Likewise."""


class LiveGallery:
    """Keeps :class:`Enrolled` up to date with the database. Safe to use from any thread."""

    def __init__(self, store: GestureStore, settings: PipelineSettings) -> None:
        self._store = store
        self._settings = settings
        self._lock = threading.Lock()
        self._current = self._read()

    @property
    def current(self) -> Enrolled:
        """What is enrolled, as of the last :meth:`refresh`."""
        return self._current

    def refresh(self) -> bool:
        """Read the database again if it changed, whichever process changed it.

        Returns:
            Whether it had changed. Takes as long as fitting the matcher; not for the event loop.
        """
        with self._lock:
            if self._store.version == self._current.version:
                return False
            self._current = self._read()
            log.info("%d gestures are enrolled", len(self._current.actions))
            return True

    def _read(self) -> Enrolled:
        # The version first: a change in between is then seen by the next refresh.
        version = self._store.version
        gestures = self._store.list()
        pairs = [
            (gesture.name, sample.template)
            for gesture in gestures
            if gesture.active
            for sample in gesture.samples
        ]
        actions = {gesture.name: gesture.action for gesture in gestures if gesture.active}
        ids = {gesture.name: gesture.id for gesture in gestures if gesture.active}
        return Enrolled(version, fit(pairs, self._settings), actions, ids)
