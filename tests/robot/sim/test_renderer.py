import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet
import pytest

from app.errors import CannotStart
from app.link.messages import ObjectState
from app.robot.models import ObjectModel, model_assets
from app.robot.models.assets import read_stl
from app.robot.models.meshes import coarsen
from app.robot.sim.backdrop import Backdrop
from app.robot.sim.lens import Lens, affine, look_at
from app.robot.sim.renderer import Renderer
from app.robot.sim.scenery import thing_outline
from app.robot.sim.shadow import Shadow, outline


@pytest.fixture(scope="module")
def shared() -> Iterator[Renderer]:
    renderer = Renderer(hardware=False)
    yield renderer
    renderer.close()


@pytest.fixture
def renderer(shared: Renderer) -> Renderer:
    """At home, with everything where it starts."""
    shared.update(
        shared.model.pose("home"),
        0.08,
        [
            ObjectState(name=thing.name, position=thing.position, orientation=turned(thing.turn))
            for thing in shared.model.objects
            if thing.mass > 0
        ],
    )
    return shared


def turned(angle: float) -> tuple[float, float, float, float]:
    return math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)


def count(picture: np.ndarray, colour: str) -> int:
    """Pixels that are clearly of one colour."""
    r, g, b = picture.astype(int).transpose(2, 0, 1)
    main, *rest = {"red": (r, g, b), "green": (g, r, b), "blue": (b, r, g)}[colour]
    return int(((main > 1.7 * rest[0]) & (main > 1.35 * rest[1])).sum())


@pytest.mark.parametrize("name", ["wrist", "scene"])
def test_pictures_have_the_models_size_and_show_something(renderer: Renderer, name: str) -> None:
    picture = renderer.picture(name)
    assert picture.shape == (240, 320, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 20
    assert (picture == 255).all(axis=2).mean() < 0.01  # no white nothing


def test_both_cameras_see_the_three_things(renderer: Renderer) -> None:
    for name in ("scene", "wrist"):
        picture = renderer.picture(name)
        for colour in ("red", "green", "blue"):
            assert count(picture, colour) > 20, (name, colour)


def test_the_same_state_gives_the_same_picture(renderer: Renderer) -> None:
    for name in renderer.names:
        assert (renderer.picture(name) == renderer.picture(name)).all()


@pytest.mark.parametrize("joint", range(6))
def test_every_joint_changes_both_pictures(renderer: Renderer, joint: int) -> None:
    before = {name: renderer.picture(name) for name in renderer.names}
    joints = renderer.model.pose("home")
    joints[joint] += 0.3
    renderer.update(joints, 0.08, ())
    for name in renderer.names:
        assert (renderer.picture(name) != before[name]).any(axis=2).mean() > 0.001


def test_the_wrist_camera_sees_the_fingers_close(renderer: Renderer) -> None:
    before = renderer.picture("wrist")
    renderer.update(renderer.model.pose("home"), 0.0, ())
    assert (renderer.picture("wrist") != before).any(axis=2).mean() > 0.005


def test_things_move_and_vanish_from_view(renderer: Renderer) -> None:
    away = ObjectState(name="red_cube", position=(-3.0, 0.0, 0.02), orientation=(1, 0, 0, 0))
    renderer.update(renderer.model.pose("home"), 0.08, [away])
    assert count(renderer.picture("scene"), "red") == 0
    assert count(renderer.picture("scene"), "green") > 20


def test_things_nobody_knows_are_passed_over(renderer: Renderer) -> None:
    before = renderer.picture("scene")
    ghost = ObjectState(name="ghost", position=(0.5, 0.0, 0.5), orientation=(1, 0, 0, 0))
    renderer.update(renderer.model.pose("home"), 0.08, [ghost])
    assert (renderer.picture("scene") == before).all()


def test_the_arm_hides_what_is_behind_it(renderer: Renderer) -> None:
    # The cube is put on the line from the scene camera to the upper arm, then behind the arm.
    camera = renderer.model.camera("scene")
    elbow = np.array([0.05, -0.15, 0.9])
    ray = (elbow - camera.eye) / np.linalg.norm(elbow - camera.eye)
    before, behind = elbow - 0.5 * ray, elbow + 0.5 * ray
    counts = []
    for place in (before, behind):
        cube = ObjectState(name="red_cube", position=tuple(place), orientation=(1, 0, 0, 0))
        renderer.update(renderer.model.pose("home"), 0.08, [cube])
        counts.append(count(renderer.picture("scene"), "red"))
    assert counts[0] > 30
    assert counts[1] < counts[0] / 4


def test_the_gripper_throws_a_shadow_on_the_table(renderer: Renderer) -> None:
    table = next(thing for thing in renderer.model.objects if thing.grid)
    shadow = Shadow(table, np.array([0.0, 0.0, 1.0]))
    box = ObjectModel(
        name="box", shape="box", size=(0.1, 0.1, 0.1), position=(0, 0, 0), colour=(1, 1, 1, 1)
    )

    def moved(points: np.ndarray, height: float) -> np.ndarray:
        return points + np.array([*table.position[:2], height])

    above = shadow.draw([moved(thing_outline(box), 0.6)])
    assert above[above.shape[0] // 2, above.shape[1] // 2] > 80
    assert above[0, 0] == 0
    # 0.1 m x 0.1 m at 200 pixels per metre.
    assert (above > 50).sum() == pytest.approx(400, rel=0.2)
    below = shadow.draw([moved(thing_outline(box), 0.1)])
    assert below.max() == 0


def test_an_unknown_camera_is_a_key_error(renderer: Renderer) -> None:
    with pytest.raises(KeyError, match="nose"):
        renderer.picture("nose")


def test_hardware_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.robot.sim.renderer.find_spec", lambda name: None)
    with pytest.raises(CannotStart, match="EGL renderer cannot be loaded"):
        Renderer(hardware=True)


def test_the_horizon_is_where_it_should_be() -> None:
    lens = Lens(320, 240, 40.0, 0.2, 5.0, middle=True)
    level = look_at(np.array([0, 0, 1.0]), np.array([1.0, 0, 1.0]), np.array([0, 0, 1.0]))
    assert lens.rise(level) @ [159.5, 119.5, 1] == pytest.approx(0)
    assert lens.rise(level) @ [10, -0.5, 1] == pytest.approx(math.tan(math.radians(20)))
    turned = look_at(np.array([0, 0, 1.0]), np.array([1.0, 0, 1.0]), np.array([0, 1.0, 0]))
    assert lens.rise(turned) @ [159.5, 7, 1] == pytest.approx(0)
    assert lens.rise(turned) @ [319.5, 7, 1] == pytest.approx(4 / 3 * math.tan(math.radians(20)))


def test_a_graphics_card_draws_the_same(renderer: Renderer, tmp_path: Path) -> None:
    program = (
        "import sys, numpy; from app.robot.sim.renderer import Renderer;"
        "r = Renderer(hardware=True);"
        "numpy.savez(sys.argv[1], **{name: r.picture(name) for name in r.names})"
    )
    # In a process of its own: EGL without a usable display may end it.
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "egl.npz")], capture_output=True, timeout=60
    )
    if done.returncode:
        pytest.skip("EGL does not work on this machine")
    drawn = np.load(tmp_path / "egl.npz")
    for name in renderer.names:
        other = np.abs(drawn[name].astype(int) - renderer.picture(name)).max(axis=2)
        assert (other > 60).mean() < 0.05  # light and edges differ, shapes do not


@pytest.mark.parametrize("up", [(0, 0, 1), (0.3, 0.2, 1.0)])
def test_the_planes_depth_and_place_are_those_that_bullet_draws(
    up: tuple[float, float, float],
) -> None:
    lens = Lens(320, 240, 40.0, 0.2, 5.0)
    view = look_at(np.array([1.75, -1.35, 1.35]), np.array([0.32, 0.02, 0.62]), np.array(up))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        shape = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=[0.33, 0.5, 0.02], physicsClientId=client
        )
        pybullet.createMultiBody(0, -1, shape, [0.66, 0, 0.38], physicsClientId=client)
        picture = pybullet.getCameraImage(
            320,
            240,
            view.T.ravel().tolist(),
            lens.projection.T.ravel().tolist(),
            renderer=pybullet.ER_TINY_RENDERER,
            shadow=0,
            physicsClientId=client,
        )
    finally:
        pybullet.disconnect(client)
    drawn = np.reshape(picture[3], (240, 320))
    columns = np.arange(320, dtype=np.float32)[None, :]
    rows = np.arange(240, dtype=np.float32)[:, None]
    plane = lens.plane(view, np.array([0, 0, 0.4]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    s, t, w = (affine(row, columns, rows) for row in plane.to_plane)
    top = (np.abs(s / w - 0.66) < 0.32) & (np.abs(t / w) < 0.49) & (w > 0)
    assert top.sum() > 5000
    assert affine(plane.depth, columns, rows)[top] == pytest.approx(drawn[top], abs=1e-6)


def test_the_backdrop_survives_every_direction() -> None:
    lens = Lens(64, 48, 60.0, 0.02, 2.5)
    table = ObjectModel(
        name="table",
        shape="box",
        size=(0.6, 1.0, 0.04),
        position=(0.6, 0.0, 0.38),
        colour=(0.7, 0.6, 0.4, 1.0),
        grid=True,
    )
    backdrop = Backdrop(lens, table, [table])
    directions = np.random.default_rng(1).normal(size=(60, 3))
    for direction in directions:
        for eye in ([0.6, 0.0, 0.6], [0.6, 0.0, 0.2], [-2.0, 1.0, 1.0]):
            view = look_at(np.array(eye), np.array(eye) + direction, np.array([0.1, 0.9, 0.2]))
            room = backdrop.draw(view)
            assert np.isfinite(room.depth).all()
            if eye[2] < 0.4:
                assert room.to_table is None
    down = look_at(np.array([0.6, 0, 0.9]), np.array([0.6, 0, 0.0]), np.array([1.0, 0, 0]))
    assert backdrop.draw(down).table.mean() > 0.5


def test_an_outline_keeps_the_corners() -> None:
    inside = np.random.default_rng(0).uniform(-0.4, 0.4, (500, 3))
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    found = outline(np.concatenate([inside, corners]))
    assert {tuple(point) for point in found} == {tuple(point) for point in corners}


def test_coarse_meshes_keep_their_shape() -> None:
    folder = model_assets("puma560").urdf_path.parent
    corners = read_stl(next(folder.glob("meshes/*/link3.stl")))
    coarse = coarsen(corners, 0.006)
    assert len(coarse) < len(corners) / 3
    assert coarse.reshape(-1, 3).min(axis=0) == pytest.approx(
        corners.reshape(-1, 3).min(axis=0), abs=0.006
    )
    assert coarse.reshape(-1, 3).max(axis=0) == pytest.approx(
        corners.reshape(-1, 3).max(axis=0), abs=0.006
    )
    # A grid finer than every detail changes nothing but the order of sums.
    assert len(coarsen(corners, 1e-6)) == len(np.unique(np.sort(corners, axis=1), axis=0))
