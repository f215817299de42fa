"""viser made private: no port, no tunnel, one message; and a new viser is noticed."""

import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path

import msgspec
import psutil
import pytest
import viser
import viser._tunnel
import viser._viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import unix_connect
from websockets.typing import Subprotocol

from app.errors import CannotStart, NotAllowed
from app.gateway.viser_scene import ViserScene
from app.gateway.viser_server import HEARD, KNOWN_VERSION, Page, PrivateServer
from benchmarks.scene_cost import CAMERA
from tests.gateway.running import StandIn, running, settings_for, wait_for
from tests.gateway.viser_types import every_message

ROOT = Path(__file__).parents[2]


@pytest.fixture
def private() -> Iterator[PrivateServer]:
    server = PrivateServer()
    yield server
    server.stop()


def listening() -> set[tuple[str, int]]:
    return {
        tuple(each.laddr)
        for each in psutil.Process().net_connections("inet")
        if each.status == psutil.CONN_LISTEN
    }


def test_it_listens_on_no_port_but_on_a_file_that_is_ours_alone() -> None:
    before = listening()
    server = PrivateServer()
    try:
        assert listening() == before
        status = server.path.stat()
        assert stat.S_ISSOCK(status.st_mode)
        assert stat.S_IMODE(status.st_mode) == 0o600
        assert stat.S_IMODE(server.path.parent.stat().st_mode) == 0o700
    finally:
        server.stop()
    assert not server.path.parent.exists()
    with pytest.raises(OSError, match="No such file"):
        unix_connect(str(server.path), "ws://viser/")


def test_any_other_server_of_viser_is_refused() -> None:
    before = listening()
    with pytest.raises(CannotStart, match="private unix socket"):
        viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    assert listening() == before


def test_there_is_no_tunnel(private: PrivateServer) -> None:
    for module in (viser._tunnel, viser._viser):
        with pytest.raises(NotAllowed, match="no public link"):
            module.ViserTunnel("share.example", 1)
    with pytest.raises(NotAllowed, match="no public link"):
        private.request_share_url()


def test_one_message_is_heard_whatever_is_sent(private: PrivateServer) -> None:
    """Even where the proxy is passed by."""
    before = psutil.Process().children(recursive=True)
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with unix_connect(str(private.path), "ws://viser/", subprotocols=[protocol]) as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))
        (client,) = wait_for(lambda: private.get_clients().values(), "the camera to be heard")
        assert set(client._websock_connection._incoming_handlers) == {HEARD}
        assert private._websock_server._incoming_handlers == {}
        for name in ("ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload"):
            socket.send(every_message()[name])
        # Read in order: what was sent before this one has had its effect.
        socket.send(msgspec.msgpack.encode({**CAMERA, "fov": 0.5}))
        wait_for(lambda: client.camera.fov == 0.5, "the last message")
    assert private._share_tunnel is None
    assert psutil.Process().children(recursive=True) == before


def test_a_viser_that_is_not_known_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viser, "__version__", "1.2.0")
    with pytest.raises(CannotStart, match=r"needs viser 1\.1\.x; 1\.2\.0 is installed"):
        PrivateServer()


def test_the_project_asks_for_the_viser_that_is_known() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "viser>=1.1.1,<1.2" in project["dependencies"]
    assert viser.__version__.startswith(KNOWN_VERSION)


def test_a_viser_that_listens_by_another_way_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[object] = []
    monkeypatch.setattr(viser.ViserServer, "__init__", lambda self, **_: None)
    monkeypatch.setattr(viser.ViserServer, "stop", lambda self: stopped.append(self))
    with pytest.raises(CannotStart, match="where it was not told to"):
        PrivateServer()
    assert len(stopped) == 1


def test_without_a_place_for_the_socket_the_view_is_off_and_says_why(
    folder: Path, node: StandIn, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with running(settings_for(folder, node.endpoint, viser=False)) as server:
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
        scene = ViserScene(server.hub.robot, None)
        monkeypatch.setattr(server.hub, "viser", scene)
        answer = server.http.get("/viser/")
        assert answer.status_code == 503
        assert "no private folder for the 3D view" in answer.json()["error"]["message"]
        with pytest.raises(InvalidStatus) as refused:
            server.socket("/viser")
        assert refused.value.response.status_code == 503
        scene.close()


def test_its_page_is_one_file() -> None:
    build = Path(viser.__file__).parent / "client" / "build"
    assert [path.name for path in build.rglob("*")] == ["index.html"]
    assert b"<!doctype html>" in Page().plain[:200].lower()
