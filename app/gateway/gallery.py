"""The gesture database as the sessions need it: a fitted matcher, and the action of each name."""

import functools
import hashlib
import logging
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError

from app.config import PipelineSettings, Settings
from app.errors import NotFound
from app.gateway.learning import Samples, fit
from app.gestures import Gesture, GestureStore
from app.gestures.backup import Place
from app.gestures.records import SHARED
from app.gestures.recovery import Hold, check_there, open_or_set_aside
from app.gestures.setfile import read_set
from app.link.actions import Action
from app.pipeline import PcaMatcher
from app.private import private_file, private_folder
from app.robot.models import load_model

log = logging.getLogger(__name__)

DATABASE_FILE = "gestures.db"
BACKUPS = "backups"
SPARE = 4
"""Galleries that stay fitted although no session uses them: who teaches asks again and again."""


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
        CannotStart: the folder cannot be made or written or is another user's, or the robot's
            profile is wrong.
    """
    url = settings.database_url
    if url is None:
        private_folder(settings.data_dir)
        url = f"sqlite:///{settings.data_dir.absolute() / DATABASE_FILE}"
    place = place_of(settings)
    if place is not None:
        private_file(place.database)
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


@functools.cache
def starter_landmarks() -> dict[bytes, bytes]:
    """Landmarks of the starter set's templates."""
    folder = starter_set()
    return {
        template: hand
        for entry in (read_set(folder) if folder is not None else ())
        for template, hand in zip(entry.templates, entry.landmarks, strict=False)
        if hand is not None
    }


def with_starter(samples: Samples) -> Samples:
    """The same, where databases older than landmarks have those of the starter set's templates."""
    known = starter_landmarks()
    return [(name, template, hand or known.get(template)) for name, template, hand in samples]


def build_matcher(
    store: GestureStore, settings: PipelineSettings, gallery: str = SHARED
) -> PcaMatcher:
    """A matcher for everything that is enrolled in a gallery now."""
    return fit(with_starter(store.active_samples(gallery)), settings)


@dataclass(frozen=True)
class Enrolled:
    """What a gallery held at one moment. Immutable, so that sessions may share it."""

    version: int
    """Of the whole database."""
    matcher: PcaMatcher
    actions: dict[str, Action] = field(default_factory=dict)
    """By the active gesture's name."""
    gallery: str = SHARED
    """The gallery's id."""
    content: tuple[Gesture, ...] = ()
    """The active gestures."""

    @property
    def ids(self) -> dict[str, str]:
        """Ids of the active gestures, by name."""
        return {gesture.name: gesture.id for gesture in self.content}


class LiveGallery:
    """Keeps :class:`Enrolled` of every gallery in use up to date with the database.

    The shared one is always in use, another between :meth:`join` and :meth:`leave`; one that is
    asked for without that is fitted then, and kept for a while. Safe to use from any thread, but
    for these two, which belong to the event loop.
    """

    def __init__(self, store: GestureStore, settings: PipelineSettings) -> None:
        self.learn: Callable[[Samples, PipelineSettings], PcaMatcher] = fit
        """Makes a matcher. Takes long, and would hold up everything in the process of a server,
        which puts another in its place."""
        self._store = store
        self._settings = settings
        self._lock = threading.Lock()
        self._users: Counter[str] = Counter((SHARED,))
        self._version = store.version
        self._prepared: tuple[bytes, PcaMatcher] | None = None
        self._fitted = {SHARED: self._read(SHARED)}

    @property
    def version(self) -> int:
        """Of the database, as of the last :meth:`refresh`."""
        return self._version

    @property
    def current(self) -> Enrolled:
        """What the shared gallery held then."""
        return self._fitted[SHARED]

    @property
    def fitted(self) -> int:
        """How many galleries have a matcher."""
        return len(self._fitted)

    def known(self, gallery: str) -> Enrolled | None:
        """What a gallery held then, if it is in use and still there. Takes no time."""
        return self._fitted.get(gallery)

    def join(self, gallery: str) -> None:
        """Begin to use a gallery: from now on :meth:`refresh` keeps it. See :meth:`of` for it."""
        self._users[gallery] += 1

    def leave(self, gallery: str) -> None:
        """End what :meth:`join` began."""
        self._users[gallery] -= 1

    def of(self, gallery: str) -> Enrolled:
        """What a gallery holds, as of the last :meth:`refresh` or now.

        May take as long as fitting a matcher; not for the event loop.

        Raises:
            NotFound: no gallery has this id.
        """
        with self._lock:
            found = self._fitted.get(gallery)
            if found is None:
                found = self._fitted[gallery] = self._read(gallery)
                self._forget_unused()
            return found

    def prepared(self, samples: Samples, matcher: PcaMatcher) -> None:
        """Take what was learned of what a gallery is about to hold: :meth:`refresh` need not.

        The newest is kept, until a gallery holds it.

        Args:
            samples: What it will hold.
            matcher: Fitted to that.
        """
        self._prepared = _digest(samples), matcher

    def refresh(self) -> bool:
        """Read the galleries in use again if anything changed, whichever process changed it.

        Returns:
            Whether something had changed. Takes as long as fitting the matchers of those that did;
            not for the event loop.
        """
        with self._lock:
            # The version first: a change in between is then seen by the next refresh.
            version = self._store.version
            if version == self._version:
                return False
            there = {gallery.id for gallery in self._store.galleries.list()}
            for id, before in tuple(self._fitted.items()):
                if id not in there or self._users[id] <= 0:
                    del self._fitted[id]
                    continue
                try:
                    now = self._fitted[id] = self._read(id, before)
                except NotFound:  # it went meanwhile
                    del self._fitted[id]
                    continue
                if now is not before:
                    log.info("%d gestures are enrolled in gallery %s", len(now.actions), id)
            self._version = version
            return True

    def _read(self, id: str, before: Enrolled | None = None) -> Enrolled:
        """What a gallery holds; ``before``, where that is still the same."""
        version = self._store.version
        content = tuple(gesture for gesture in self._store.list(id) if gesture.active)
        if before is not None and before.content == content:
            return before
        samples = _samples(content)
        actions = {gesture.name: gesture.action for gesture in content}
        # What gestures do is changed more often than how they look.
        same = before is not None and _digest(_samples(before.content)) == _digest(samples)
        matcher = before.matcher if before is not None and same else self._matcher(samples)
        return Enrolled(version, matcher, actions, id, content)

    def _matcher(self, samples: Samples) -> PcaMatcher:
        prepared = self._prepared
        if prepared is not None and prepared[0] == _digest(samples):
            self._prepared = None
            return prepared[1]
        return self.learn(samples, self._settings)

    def _forget_unused(self) -> None:
        unused = [id for id in self._fitted if self._users[id] <= 0]
        for id in unused[:-SPARE]:
            del self._fitted[id]


def _samples(content: Iterable[Gesture]) -> Samples:
    return with_starter(
        [
            (gesture.name, sample.template, sample.landmarks)
            for gesture in content
            for sample in gesture.samples
        ]
    )


def _digest(samples: Samples) -> bytes:
    """The same for the same samples of the same names, in whatever order the names come."""
    digest = hashlib.sha256()
    for name, template, hand in sorted(samples, key=lambda sample: sample[0]):
        digest.update(repr(name).encode() + template + (hand or b"-"))
    return digest.digest()
