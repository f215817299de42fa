"""Servers, one a test or one for all that leave it as it was, and pictures of hands."""

import shutil
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
import simplejpeg

from app.gateway.gallery import DATABASE_FILE, starter_set
from app.gestures import GestureStore, NewGesture, read_set
from app.gestures.hand import POSES, HandView, render_hand
from tests.gateway.running import Running, StandIn, running, settings_for


@pytest.fixture
def short_path() -> Iterator[Path]:
    """A private folder with a path short enough for a unix socket."""
    folder = Path(tempfile.mkdtemp(prefix="fh-"))
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def node(short_path: Path) -> Iterator[StandIn]:
    with StandIn(short_path) as stand_in:
        yield stand_in


@pytest.fixture(scope="session")
def small_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The starter gestures with two samples each: fitted in a fifth of the time."""
    folder = tmp_path_factory.mktemp("database")
    path = folder / DATABASE_FILE
    starter = starter_set()
    assert starter is not None
    store = GestureStore(f"sqlite:///{path}", None)
    store.put_all(
        [NewGesture(entry.name, entry.action, entry.templates[:2]) for entry in read_set(starter)]
    )
    store.close()
    return path


@pytest.fixture
def folder(tmp_path: Path, small_database: Path) -> Path:
    """A folder for a server, its database filled."""
    (tmp_path / "data").mkdir()
    shutil.copy(small_database, tmp_path / "data" / DATABASE_FILE)
    return tmp_path


@pytest.fixture
def server(node: StandIn, folder: Path) -> Iterator[Running]:
    with running(settings_for(folder, node.endpoint)) as here:
        yield here


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory, small_database: Path) -> Iterator[Running]:
    """A server for all tests of a file that leave it as it was: those of what is refused."""
    folder = tmp_path_factory.mktemp("lasting")
    (folder / "data").mkdir()
    shutil.copy(small_database, folder / "data" / DATABASE_FILE)
    with (
        tempfile.TemporaryDirectory(prefix="fh-", ignore_cleanup_errors=True) as short,
        StandIn(Path(short)) as node,
        running(settings_for(folder, node.endpoint)) as here,
    ):
        yield here


@cache
def draw(gesture: str | None, turn: float = 0.0) -> bytes:
    """A webcam frame as JPEG: a drawn hand, or an empty room."""
    if gesture is None:
        # The room without a hand: the hand is far outside.
        view = HandView(270.0, (320.0, 2000.0))
        picture = render_hand(POSES["stop"], view=view)
    else:
        picture = render_hand(POSES[gesture], view=HandView(270.0, turn=turn))
    return simplejpeg.encode_jpeg(picture, quality=85, colorspace="BGR")


@pytest.fixture(scope="session")
def hand() -> Callable[..., bytes]:
    """``hand("forward")``: a frame that shows the gesture; ``hand(None)``: nothing."""
    return draw
