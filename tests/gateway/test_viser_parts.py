"""What the 3D view shows beside the arm, in a real viser scene with the real model."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import simplejpeg
import viser
from viser.extras import ViserUrdf

from app.errors import RobotUnavailable
from app.gateway.viser_cameras import RETRY_S, CameraViews, orientation_of, parent_of, small
from app.gateway.viser_rehearsal import (
    LONGEST_LABEL,
    LONGEST_S,
    MOST_KEPT,
    MOST_MARKS,
    REST_S,
    ROUNDS,
    Rehearsals,
    index_at,
    marks_of,
    way_of,
)
from app.gateway.viser_server import PrivateServer
from app.gateway.viser_trail import LASTS_S, MOST_POINTS, NEW, OLD, Trail, fading
from app.link.header import FrameHeader
from app.link.messages import DryRunPath, DryRunProblem, DryRunReport
from app.robot.models import model_assets
from app.robot.models.meshes import drawn_urdf


@pytest.fixture(scope="module")
def scene() -> Iterator[viser.ViserServer]:
    server = PrivateServer()
    yield server
    server.stop()


# The trail


def test_the_trail_follows_the_tool_and_forgets(scene: viser.ViserServer) -> None:
    trail = Trail(scene, "/trail")
    for step in range(60 * 20):
        trail.update(step / 60, (step * 0.001, 0.0, 0.5))
        assert len(trail.points) <= MOST_POINTS
    first, last = trail.points[0], trail.points[-1]
    assert last[0] == pytest.approx(1.2, abs=0.01)
    assert (last[0] - first[0]) / 0.06 == pytest.approx(LASTS_S, abs=0.2)
    # A tool that stands adds nothing, and what it left behind goes.
    for step in range(60 * 20, 60 * 30):
        trail.update(step / 60, (1.2, 0.0, 0.5))
    assert len(trail.points) <= 1
    # Another robot has another clock.
    trail.update(1.0, (0.0, 0.0, 0.0))
    assert trail.points == [(0.0, 0.0, 0.0)]
    trail.remove()


def test_the_trail_fades_towards_its_end() -> None:
    colours = fading(5)
    assert colours.shape == (4, 2, 3)
    assert colours.dtype == np.uint8
    assert tuple(colours[0, 0]) == OLD
    assert tuple(colours[-1, 1]) == NEW
    assert (colours[1:, 0] == colours[:-1, 1]).all()


# The cameras


class Pictures:
    """Stands for the robot's cameras."""

    def __init__(self) -> None:
        self.open: dict[str, Callable[[FrameHeader, bytes], None]] = {}
        self.broken = False

    def watch(self, name: str, take: Callable[[FrameHeader, bytes], None]) -> "Watch":
        if self.broken:
            raise RobotUnavailable("no pictures", robot="puma")
        self.open[name] = take
        return Watch(self, name)

    def send(self, name: str, grey: int) -> None:
        picture = np.full((240, 320, 3), grey, np.uint8)
        self.open[name](FrameHeader(1, 0.0, 1), simplejpeg.encode_jpeg(picture))


class Watch:
    def __init__(self, pictures: Pictures, name: str) -> None:
        self.pictures, self.name = pictures, name

    def close(self) -> None:
        del self.pictures.open[self.name]


@pytest.fixture(scope="module")
def puma(scene: viser.ViserServer) -> ViserUrdf:
    scene.scene.add_frame("/robot", show_axes=False)
    return ViserUrdf(scene, drawn_urdf(model_assets("puma560"), 0.006), root_node_name="/robot")


def test_cameras_are_watched_while_somebody_looks_and_show_few_pictures(
    scene: viser.ViserServer, puma: ViserUrdf
) -> None:
    now = 100.0
    pictures = Pictures()
    views = CameraViews(scene, puma, model_assets("puma560").model, pictures.watch)
    assert not views.watching
    views.update(now)
    assert set(pictures.open) == {"wrist", "scene"}
    for _ in range(30):  # a second of 30 pictures
        pictures.send("wrist", 100)
        views.update(now)
        now += 1 / 30
    assert views.shown == {"wrist": 3, "scene": 0}
    views.rest()
    assert pictures.open == {}
    # A camera that cannot be watched is asked for again, but not at once.
    pictures.broken = True
    now += 10
    views.update(now)
    pictures.broken = False
    views.update(now)
    assert not views.watching
    now += RETRY_S
    views.update(now)
    assert views.watching
    views.remove()
    assert pictures.open == {}


def test_a_frustum_hangs_on_its_link_and_looks_where_the_camera_does(puma: ViserUrdf) -> None:
    model = model_assets("puma560").model
    wrist = parent_of(puma, "gripper", "/robot")
    assert wrist.startswith("/robot/visual/link1/link2/")
    assert wrist.endswith("/gripper")
    assert parent_of(puma, "link0", "/robot") == "/robot/visual"
    assert parent_of(puma, "room", "/robot") == ""
    for camera in model.cameras:
        turn = viser.transforms.SO3(np.array(orientation_of(camera))).as_matrix()
        ahead = np.subtract(camera.target, camera.eye)
        assert turn[:, 2] == pytest.approx(ahead / np.linalg.norm(ahead), abs=1e-6)
        assert float(turn[:, 1] @ np.array(camera.up)) < 0  # y points down in the picture


@pytest.mark.parametrize("size", [(240, 320), (480, 640), (90, 90), (96, 128)])
def test_pictures_are_made_small(size: tuple[int, int]) -> None:
    picture = small(simplejpeg.encode_jpeg(np.zeros((*size, 3), np.uint8)))
    assert picture is not None
    height, width, _ = picture.shape
    assert height <= 96 and width <= 128
    assert width / height == pytest.approx(size[1] / size[0], abs=0.02)


def test_what_is_no_picture_is_left_out() -> None:
    assert small(b"\xff\xd8 nonsense") is None


# Dry runs


def report(*problems: DryRunProblem, base: bool = False) -> DryRunReport:
    times = tuple(step / 10 for step in range(21))
    return DryRunReport(
        ok=not problems,
        duration_s=2.0,
        problems=problems,
        path=DryRunPath(
            times=times,
            joints=tuple((time,) * (2 if base else 6) for time in times),
            tool=tuple((0.5, time / 10, 0.7) for time in times),
            base=tuple((time, 1.0, 0.5) for time in times) if base else (),
        ),
    )


def problem(time_s: float, kind: str = "joint_limit", step: int | None = 2) -> DryRunProblem:
    return DryRunProblem(step=step, time_s=time_s, kind=kind, message="joint 5 is at its limit")


def test_the_way_is_the_tools_or_a_bases_on_the_floor() -> None:
    assert way_of(report())[-1] == pytest.approx((0.5, 0.2, 0.7))
    assert way_of(report(base=True))[-1] == pytest.approx((2.0, 1.0, 0.03))
    assert way_of(DryRunReport()).shape == (0, 3)
    still = report().model_copy(
        update={"path": DryRunPath(times=(0, 1), joints=((0,) * 6,) * 2, tool=((1, 1, 1),) * 2)}
    )
    assert len(way_of(still)) == 1


def test_limits_are_marked_where_they_are_met_in_words() -> None:
    slow = problem(0.5, "slowed", None)
    marks = marks_of(report(slow, problem(1.0)))
    assert [(mark.text, mark.broken) for mark in marks] == [
        ("! Step 2: joint 5 is at its limit", True),
        ("slower joint 5 is at its limit", False),
    ]
    assert marks[0].place == pytest.approx((0.5, 0.1, 0.7))
    assert marks_of(report(problem(1.0), base=True))[0].place == pytest.approx((1.0, 1.0, 0.03))


def test_marks_in_one_place_are_one_and_there_are_few() -> None:
    (one,) = marks_of(report(problem(1.0), problem(1.05, "slowed"), problem(1.0, step=3)))
    assert one.broken
    assert len(one.text) <= LONGEST_LABEL
    assert len(marks_of(report(*(problem(time / 2) for time in range(5))))) == 5
    wide = report(*(problem(2 * n / 29) for n in range(30)))
    far = wide.path.model_copy(update={"tool": tuple((t, 0.0, 0.0) for t in wide.path.times)})
    assert len(marks_of(wide.model_copy(update={"path": far}))) == MOST_MARKS
    assert marks_of(DryRunReport(problems=(problem(0.0),))) == []


def test_the_ghost_goes_along_a_few_times_and_stays_at_the_end() -> None:
    times = [0.0, 1.0, 2.0]
    at = [index_at(times, since, still=False) for since in (0.0, 0.9, 1.1, 2.0, 3.4, 3.6)]
    assert at == [0, 0, 1, 2, 2, 0]
    assert index_at(times, ROUNDS * (2.0 + REST_S), still=False) == 2
    assert index_at(times, 0.0, still=True) == 2
    assert index_at([0.0, 500.0, 1000.0], LONGEST_S * 0.75, still=False) == 1  # faster
    assert index_at([0.0], 5.0, still=False) == 0


def test_few_dry_runs_are_kept() -> None:
    rehearsals = Rehearsals()
    for number in range(MOST_KEPT + 3):
        rehearsals.show(f"view-{number:016}", report(), still=False)
    assert len(rehearsals.kept) == MOST_KEPT
    rehearsals.hide(rehearsals.kept[-1])
    rehearsals.hide("view-of-nobody-1234")
    assert len(rehearsals.kept) == MOST_KEPT - 1
