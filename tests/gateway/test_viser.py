"""The 3D view behind the gateway, with the real viser and the real model."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import psutil
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from app.gateway.pace import Pace
from app.gateway.tokens import TokenStore
from app.gateway.viser_aids import box_edges, label_of
from app.gateway.viser_messages import BURST, MAX_HZ
from app.gateway.viser_rehearsal import view_of
from app.gateway.viser_scene import ViserScene
from app.link.messages import DryRunPath, DryRunProblem, DryRunReport
from benchmarks.scene_cost import CAMERA
from tests.gateway.running import (
    NEAR,
    Running,
    StandIn,
    StandInCamera,
    running,
    settings_for,
    wait_for,
)
from tests.gateway.viser_types import every_message

PROTOCOL = f"viser-v{viser.__version__}"
PATHS_THAT_ARE_NOT = (
    "index.html", "nothing.js", "%00", "%2F", "/", "%2e%2e/", "..%2f..%2f_viser.py", "%5c..%5c",
    "%0d%0aX-Evil:%201", "%ff", "a" * 5000, "%3Fx", "viser/",
)  # fmt: skip


@pytest.fixture
def with_viser(node: StandIn, folder: Path) -> Iterator[Running]:
    with running(settings_for(folder, node.endpoint, viser=True)) as server:
        yield server


def test_the_view_is_served_through_the_gateway(with_viser: Running, node: StandIn) -> None:
    server = with_viser
    page = server.http.get("/viser/")
    assert page.status_code == 200
    assert page.headers["content-type"].startswith("text/html")
    assert "<!doctype html>" in page.text.lower()
    policy = page.headers["content-security-policy"]
    assert "frame-ancestors 'self'" in policy
    assert "http" not in policy
    assert server.http.get("/viser").headers["location"] == "/viser/"

    scene = server.hub.viser
    assert scene is not None
    wait_for(lambda: scene.shown_tick, "the scene to be built", 60)
    assert scene.shows_robot
    assert scene.notice is None
    with server.socket("/viser", subprotocols=[PROTOCOL]) as socket:
        assert socket.subprotocol == PROTOCOL
        size = 0
        # The robot's meshes: far more than an empty scene.
        while size < 20_000:
            size += len(socket.recv(timeout=20))


def test_nothing_but_the_page_is_served(with_viser: Running) -> None:
    for path in PATHS_THAT_ARE_NOT:
        answer = with_viser.http.get(f"/viser/{path}")
        assert answer.status_code == 404, path
        assert answer.json()["error"]["code"] == "not_found"


def test_the_page_is_sent_as_it_is_whatever_is_asked(with_viser: Running) -> None:
    plain = with_viser.http.get("/viser/", headers={"Accept-Encoding": "identity"})
    packed = with_viser.http.get("/viser/?a=b&websocket=wss://evil.example/#c")
    assert packed.headers["content-encoding"] == "gzip"
    assert plain.content == packed.content
    assert set(plain.headers) - set(with_viser.http.get("/nothing").headers) == {"vary"}
    assert "connect-src 'self'" in packed.headers["content-security-policy"]
    assert with_viser.http.post("/viser/").status_code == 405


# What a browser may send


class Connects:
    """Sees which addresses this process asks for or connects to; a hook of Python's stays."""

    def __init__(self) -> None:
        self.seen: list[str] | None = None
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.seen is None:
            return
        if event == "socket.connect" and isinstance(arguments[1], tuple):
            self.seen.append(str(arguments[1][0]))
        elif event == "socket.getaddrinfo":
            self.seen.append(str(arguments[0]))


connects = Connects()


def closed_with(socket: ClientConnection) -> int:
    """Read to the end: the code that the server closes with."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            socket.recv(timeout=20)
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


def test_of_every_message_that_viser_knows_one_arrives(with_viser: Running) -> None:
    """Whoever may look may not upload, draw, press, or have the scene shown to the internet."""
    with_viser.http.get("/viser/")
    scene = with_viser.hub.viser
    assert scene is not None and scene.server is not None
    arrived: list[str] = []
    inner = scene.server._websock_server
    handle = inner._handle_incoming_message

    async def handle_incoming(client: Any, message: Any) -> None:
        arrived.append(type(message).__name__)
        await handle(client, message)

    inner._handle_incoming_message = handle_incoming  # type: ignore[method-assign]
    processes = psutil.Process().children(recursive=True)
    codes = {}
    connects.seen = []
    try:
        for name, message in every_message().items():
            with with_viser.socket("/viser", subprotocols=[PROTOCOL]) as socket:
                socket.send(message)
                if name == "ViewerCameraMessage":
                    wait_for(lambda: arrived, "the camera to arrive")
                else:
                    codes[name] = closed_with(socket)
        told = connects.seen
    finally:
        connects.seen = None
    assert arrived == ["ViewerCameraMessage"]
    assert len(codes) > 100
    assert set(codes.values()) == {1008}
    assert set(told) <= {"127.0.0.1"}
    assert psutil.Process().children(recursive=True) == processes
    text = with_viser.http.get("/metrics").text
    assert f'farhand_bad_messages_total{{code="viewer_message"}} {len(codes):.1f}' in text


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("ViewerCameraMessage", 1008),
        (b"", 1008),
        (b"\xdf\xff\xff\xff\xff", 1008),
        (bytes(2000), 1009),
        (bytes(5 << 20), 1009),
    ],
    ids=["text", "empty", "map of four billion", "long", "very long"],
)
def test_a_viewer_that_sends_something_else_is_turned_away(
    with_viser: Running, message: str | bytes, code: int
) -> None:
    with_viser.http.get("/viser/")
    with with_viser.socket("/viser", subprotocols=[PROTOCOL]) as socket:
        socket.send(message)
        assert closed_with(socket) == code
    # Nobody else notices.
    with with_viser.socket("/viser", subprotocols=[PROTOCOL]) as socket:
        assert socket.recv(timeout=20)


def test_what_a_viewer_says_again_and_again_is_slowed(
    with_viser: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float] = []

    class Slow(Pace):
        def wait_s(self, now: float) -> float:
            waits.append(super().wait_s(0.0))  # no time passes
            return min(waits[-1], 0.001)

    monkeypatch.setattr("app.gateway.viser_proxy.Pace", Slow)
    with_viser.http.get("/viser/")
    with with_viser.socket("/viser", subprotocols=[PROTOCOL]) as socket:
        for _ in range(BURST + 50):
            socket.send(msgspec.msgpack.encode(CAMERA))
        wait_for(lambda: len(waits) == BURST + 50, "all to be read")
    assert set(waits[:BURST]) == {0.0}
    assert waits[-1] == pytest.approx(50 / MAX_HZ)


def test_what_a_viewer_sees_ends_with_its_token(with_viser: Running) -> None:
    with_viser.http.get("/viser/")
    scene = with_viser.hub.viser
    assert scene is not None and scene.server is not None
    tokens = TokenStore(with_viser.hub.settings.data_dir / "tokens.json")
    made = tokens.make("observer", "tablet")
    bearer = {"Authorization": f"Bearer {made.secret}"}
    server = scene.server
    with with_viser.socket("/viser", subprotocols=[PROTOCOL], additional_headers=bearer) as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))
        wait_for(server.get_clients, "an observer to look")
        tokens.revoke(made.token.id)
        assert closed_with(socket) == 1008
    wait_for(lambda: not server.get_clients(), "viser's own end to close")
    with pytest.raises(InvalidStatus) as refused:
        with_viser.socket("/viser", subprotocols=[PROTOCOL], additional_headers=bearer)
    assert refused.value.response.status_code == 401


def test_a_client_of_another_version_is_closed_as_viser_says(with_viser: Running) -> None:
    with_viser.http.get("/viser/")
    with (
        with_viser.socket("/viser", subprotocols=["viser-v0.0.1"]) as socket,
        pytest.raises(ConnectionClosed) as closed,
    ):
        socket.recv(timeout=20)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1002


def test_standard_output_is_left_to_the_link(
    server: Running, capfd: pytest.CaptureFixture[str]
) -> None:
    out = sys.stdout
    scene = ViserScene(server.hub.robot, None)
    try:
        while scene.wait_socket(0.001) is None:
            # Redirecting it would swallow what another thread prints now.
            assert sys.stdout is out
    finally:
        scene.close()
    assert capfd.readouterr().out == ""


def test_a_view_that_is_off_is_told(server: Running) -> None:
    answer = server.http.get("/viser/")
    assert answer.status_code == 503
    assert answer.json()["error"]["code"] == "viewer_unavailable"
    with pytest.raises(InvalidStatus) as refused:
        server.socket("/viser", subprotocols=[PROTOCOL])
    assert refused.value.response.status_code == 503


def test_viser_that_has_gone_is_told_and_hurts_nothing(with_viser: Running) -> None:
    with_viser.http.get("/viser/")
    scene = with_viser.hub.viser
    assert scene is not None and scene.server is not None
    scene.server.stop()
    for _ in range(2):
        with pytest.raises(InvalidStatus) as refused:
            with_viser.socket("/viser", subprotocols=[PROTOCOL])
        assert refused.value.response.status_code == 503
        scene.close()
    assert with_viser.http.get("/viser/").status_code == 503
    assert with_viser.http.get("/api/gestures").status_code == 200


def test_the_ghost_shows_only_where_the_arm_is_not_where_it_should_be(
    with_viser: Running,
) -> None:
    scene = with_viser.hub.viser
    assert scene is not None
    wait_for(lambda: scene.shown_tick, "the scene to be built", 60)
    assert scene.aids is not None
    assert not scene.aids.ghost_shown
    assert scene.aids.told == "50 mm to table"
    # Nobody looks, so that only this test updates the scene from now on.
    actual = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.02])
    scene.aids.update(actual, actual + 0.01, NEAR)
    assert not scene.aids.ghost_shown
    scene.aids.update(actual, actual + 0.1, None)
    assert scene.aids.ghost_shown
    assert scene.aids.told is None
    scene.aids.update(actual, actual, NEAR.model_copy(update={"distance": 0.0124}))
    assert not scene.aids.ghost_shown
    assert scene.aids.told == "12 mm to table"


def test_what_is_near_is_named_in_plain_words() -> None:
    assert label_of(NEAR, {}) == "50 mm to table"
    itself = NEAR.model_copy(update={"thing": "link3", "distance": 0.0612})
    assert label_of(itself, {"link3": "forearm"}) == "61 mm to forearm"
    assert label_of(NEAR.model_copy(update={"thing": "cube_red"}), {}) == "50 mm to cube red"


def test_the_box_has_its_twelve_edges() -> None:
    edges = box_edges((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert edges.shape == (12, 2, 3)
    lengths = np.abs(edges[:, 1] - edges[:, 0])
    assert sorted(lengths.sum(axis=1).tolist()) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4
    assert (np.count_nonzero(lengths, axis=1) == 1).all()
    assert len({tuple(map(tuple, edge)) for edge in edges.tolist()}) == 12


def test_without_the_robots_profile_the_view_says_so_and_goes_on(
    folder: Path, node: StandIn
) -> None:
    """The stand-in's joints are not the husky's: it is another robot than the profile says."""
    settings = settings_for(folder, node.endpoint, viser=True)
    robot = settings.robot.model_copy(update={"profile": "husky"})
    with running(settings.model_copy(update={"robot": robot})) as server:
        scene = server.hub.viser
        assert scene is not None
        wait_for(lambda: scene.shown_tick, "a state to be shown", 60)
        assert not scene.shows_robot
        assert scene.notice is not None
        assert scene.notice.startswith("The profile of Stand-in is not on this machine")
        assert server.http.get("/viser/").status_code == 200


MINE, OTHERS = "my-view-0123456789", "your-view-0123456789"


def look(server: Running, view: str) -> ClientConnection:
    socket = server.socket(f"/viser?view={view}", subprotocols=[PROTOCOL])
    socket.send(msgspec.msgpack.encode(CAMERA))
    return socket


def test_a_dry_run_is_shown_to_who_asked_and_to_nobody_else(
    with_viser: Running, node: StandIn
) -> None:
    scene = with_viser.hub.viser
    assert scene is not None
    wait_for(lambda: scene.shown_tick, "the scene to be built", 60)
    rehearsals = scene.rehearsals
    steps = [step / 10 for step in range(11)]
    report = DryRunReport(
        duration_s=1.0,
        problems=(DryRunProblem(step=1, time_s=0.5, kind="joint_limit", message="too far"),),
        path=DryRunPath(
            times=tuple(steps),
            joints=tuple((step,) * 6 for step in steps),
            tool=tuple((0.5, step, 0.7) for step in steps),
        ),
    )
    rehearsals.show(MINE, report, still=True)  # before anybody looks: it waits
    with StandInCamera(node, "wrist") as camera:
        mine, others = look(with_viser, MINE), look(with_viser, OTHERS)
        wait_for(lambda: rehearsals.shown == 1, "the dry run to be shown", 60)
        assert scene.server is not None
        clients = scene.server.get_clients()
        assert len(clients) == 2
        named = {client: view_of(scene.server, client) for client in clients}
        assert sorted(named.values(), key=str) == [MINE, OTHERS]
        for client, name in named.items():
            nodes = clients[client].scene._handle_from_node_name
            assert ("/dry_run/way" in nodes) == (name == MINE)
            assert ("/dry_run/mark_0" in nodes) == (name == MINE)
        # Somebody looks, so that the cameras are watched.
        assert scene.cameras is not None
        wait_for(lambda: camera.watched, "the camera to be watched")
        rehearsals.hide(MINE)
        wait_for(lambda: rehearsals.shown == 0, "the dry run to be gone")
        assert all("/dry_run" not in c.scene._handle_from_node_name for c in clients.values())
        # What is shown ends with the link, and comes back with it.
        rehearsals.show(MINE, report, still=False)
        wait_for(lambda: rehearsals.shown == 1, "the next one")
        mine.close()
        wait_for(lambda: rehearsals.shown == 0, "the link to end")
        mine = look(with_viser, MINE)
        wait_for(lambda: rehearsals.shown == 1, "it to come back")
        mine.close()
        others.close()
        wait_for(lambda: not scene.cameras.watching, "the cameras to rest")
