"""The 3D view behind the gateway, with the real viser and the real model."""

import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from app.gateway.viser_aids import box_edges, label_of
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

PROTOCOL = f"viser-v{viser.__version__}"


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
    missing = server.http.get("/viser/nothing.js")
    assert missing.status_code == 404

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

    # viser itself listens on loopback alone.
    port = scene.wait_port(1)
    assert port is not None
    assert httpx.get(f"http://127.0.0.1:{port}/", trust_env=False).status_code == 200


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
        while scene.wait_port(0.001) is None:
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
    assert scene is not None
    scene.close()
    answer = with_viser.http.get("/viser/")
    assert answer.status_code == 503
    with pytest.raises(InvalidStatus) as refused:
        with_viser.socket("/viser", subprotocols=[PROTOCOL])
    assert refused.value.response.status_code == 503
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
