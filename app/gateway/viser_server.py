"""viser made private: a unix socket in place of a port, no tunnel, and one message that is heard.

viser is meant for a researcher's own machine. Left alone it listens on a TCP port and asks nobody
who they are, and any viewer may have it dial a public relay that shows the scene to whoever has the
link. Neither can be switched off, so this module replaces names inside of viser, once, when it is
imported; every other module that needs a server of viser takes :class:`PrivateServer`.

What is replaced belongs to viser 1.1 (``pyproject.toml`` pins it). With any other version, or where
the listener was not used, no server is made.
"""

import gzip
import socket
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import viser
import websockets.datastructures
import websockets.exceptions
from viser import _messages, _tunnel, _viser, infra
from viser.infra import _infra
from websockets.asyncio.server import ServerConnection, unix_serve

from app.errors import CannotStart, NotAllowed
from app.scratch import ScratchFolder

KNOWN_VERSION = "1.1."
"""What the version of viser begins with whose insides are known here."""
HEARD = _messages.ViewerCameraMessage
"""The one message that viser acts on: where a viewer's camera is. See ``viser_messages``."""
SOCKET_MODE = 0o600
UNIX_ALONE = "in this process viser listens on nothing but a private unix socket"
NO_TUNNEL = "the 3D view is shown to who is signed in, and by no public link"


class NoTunnel:
    """Stands where viser's tunnel to a public relay stood.

    Raises:
        NotAllowed: always.
    """

    def __init__(self, *_: object, **__: object) -> None:
        raise NotAllowed(NO_TUNNEL)


def _serve(
    handler: Callable[[ServerConnection], Any], host: object, port: object, **options: Any
) -> Any:
    """Stands where viser's server looks for ``websockets.asyncio.server.serve``.

    Raises:
        CannotStart: ``host`` is not a socket that :class:`PrivateServer` has made.
    """
    if not isinstance(host, _Listener):
        raise CannotStart(UNIX_ALONE)
    host.is_used = True
    return unix_serve(handler, sock=host, **options)


class _Listener(socket.socket):
    """A unix socket in a folder of its own, which nobody else may enter."""

    is_used = False

    def __init__(self, path: Path) -> None:
        super().__init__(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self.bind(str(path))
            path.chmod(SOCKET_MODE)
        except OSError:
            self.close()
            raise


class _UnixServer(infra.WebsockServer):
    """Refuses any other host before viser waits for a thread that would never be ready."""

    def __init__(self, host: str, *arguments: Any, **options: Any) -> None:
        if not isinstance(host, _Listener):
            raise CannotStart(UNIX_ALONE)
        super().__init__(host, *arguments, **options)


def _make_private() -> None:
    """Replace what would open ports and tunnels, in this whole process."""
    for module in (_tunnel, _viser):
        module.ViserTunnel = NoTunnel  # type: ignore[attr-defined]
    stand_in = SimpleNamespace(
        asyncio=SimpleNamespace(server=SimpleNamespace(serve=_serve)),
        datastructures=websockets.datastructures,
        exceptions=websockets.exceptions,
    )
    _infra.websockets = stand_in  # type: ignore[attr-defined,assignment]
    infra.WebsockServer = _UnixServer  # type: ignore[misc]


_make_private()


class PrivateServer(viser.ViserServer):
    """A server of viser that is reached by its socket's path, by this user's processes alone.

    Attributes:
        path: Of the socket.

    Raises:
        CannotStart: this version of viser is not known here, or there is no place for the socket.
    """

    def __init__(self) -> None:
        if not viser.__version__.startswith(KNOWN_VERSION):
            raise CannotStart(
                f"the 3D view needs viser {KNOWN_VERSION}x; {viser.__version__} is installed"
            )
        try:
            self._folder = ScratchFolder()
        except OSError as error:
            raise CannotStart(f"no private folder for the 3D view: {error}") from error
        self.path = self._folder.path / "viser"
        try:
            listener = _Listener(self.path)
        except OSError as error:
            self._folder.close()
            raise CannotStart(f"no socket for the 3D view at {self.path}: {error}") from error
        super().__init__(host=cast(str, listener), port=0, verbose=False)
        if not listener.is_used:
            self.stop()
            listener.close()
            raise CannotStart("viser listens where it was not told to; the 3D view stays off")
        # viser takes the second part of a socket's name for its port.
        self._websock_server._host, self._websock_server._port = str(self.path), 0
        self._hear_nothing_else()

    def _hear_nothing_else(self) -> None:
        """Act on no message of a viewer but :data:`HEARD`, whatever the proxy may let through."""
        self._websock_server._incoming_handlers.clear()

        @self._websock_server.on_client_connect
        def _(connection: infra.WebsockClientConnection) -> None:
            handlers = connection._incoming_handlers
            for kind in [kind for kind in handlers if kind is not HEARD]:
                del handlers[kind]

    def request_share_url(self, verbose: bool = True) -> str | None:
        """There is no public link.

        Raises:
            NotAllowed: always.
        """
        raise NotAllowed(NO_TUNNEL)

    def stop(self) -> None:
        """End the server's threads, and take its socket away."""
        super().stop()
        self._folder.close()


class Page:
    """viser's page, which is one file: its bytes, and its bytes compressed.

    Raises:
        CannotStart: it is not where this version of viser has it.
    """

    def __init__(self) -> None:
        path = Path(viser.__file__).parent / "client" / "build" / "index.html"
        try:
            self.plain = path.read_bytes()
        except OSError as error:
            raise CannotStart(f"viser's page is missing: {error}", path=str(path)) from error
        self.compressed = gzip.compress(self.plain, mtime=0)
