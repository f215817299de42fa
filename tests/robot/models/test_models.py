import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yourdfpy
from pydantic import ValidationError

from app.errors import CannotStart
from app.robot.models import Model, assets, load_model, model_assets, model_folder, model_names
from app.robot.models.assets import read_stl, write_stl

SOURCE = ElementTree.parse(model_folder("puma560") / "puma560.urdf").getroot()
DEGREE = np.pi / 180


def joints_of(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    return {joint.get("name", ""): joint for joint in root.findall("joint")}


def test_there_is_a_puma() -> None:
    assert "puma560" in model_names()
    assert load_model("puma560").name == "Unimation PUMA 560"


def test_limits_in_the_urdf_are_those_of_the_model() -> None:
    model, joints = load_model("puma560"), joints_of(SOURCE)
    for joint in model.joints:
        limit = joints[joint.name].find("limit")
        assert limit is not None
        assert float(limit.get("lower", 0)) == joint.lower
        assert float(limit.get("upper", 0)) == joint.upper
        assert float(limit.get("velocity", 0)) == joint.velocity
        assert float(limit.get("effort", 0)) == joint.torque
    for name in model.gripper.fingers:
        limit = joints[name].find("limit")
        assert limit is not None
        assert float(limit.get("upper", 0)) * 2 == model.gripper.width
        assert float(limit.get("velocity", 0)) == model.gripper.speed
        assert float(limit.get("effort", 0)) == model.gripper.force


def test_limits_are_the_published_ones() -> None:
    published = [
        (-160, 160, 82),
        (-45, 225, 54),
        (-225, 45, 122),
        (-110, 170, 228),
        (-100, 100, 241),
        (-266, 266, 228),
    ]
    for joint, (lower, upper, speed) in zip(load_model("puma560").joints, published, strict=True):
        assert joint.lower == pytest.approx(lower * DEGREE, abs=1e-3)
        assert joint.upper == pytest.approx(upper * DEGREE, abs=1e-3)
        assert joint.velocity == pytest.approx(speed * DEGREE, abs=1e-3)


def test_every_joint_stops_within_200_ms() -> None:
    for joint in load_model("puma560").joints:
        # Full speed to standstill under the limits of acceleration and jerk.
        ramp = joint.velocity / joint.acceleration + joint.acceleration / joint.jerk
        assert 0.17 < ramp < 0.2


def test_masses_and_inertias_are_those_of_real_bodies() -> None:
    for link in SOURCE.findall("link"):
        inertia, mass = link.find("inertial/inertia"), link.find("inertial/mass")
        assert inertia is not None and mass is not None, link.get("name")
        assert float(mass.get("value", 0)) > 0
        xx, yy, zz, xy, xz, yz = (
            float(inertia.get(name, 0)) for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert (moments > 0).all()
        # The largest principal moment of a rigid body is at most the sum of the others.
        assert moments[2] <= moments[0] + moments[1] + 1e-12, link.get("name")


def test_the_arm_weighs_what_armstrong_measured() -> None:
    mass = {
        link.get("name"): float(link.find("inertial/mass").get("value"))  # type: ignore
        for link in SOURCE.findall("link")
    }
    assert [mass[f"link{n}"] for n in range(2, 7)] == [17.4, 4.8, 0.82, 0.34, 0.09]
    gripper = mass["gripper"] + mass["left_finger"] + mass["right_finger"]
    assert gripper == pytest.approx(0.9)  # the PUMA 560 carries 2.5 kg


def test_the_assets_load_in_yourdfpy_with_meshes() -> None:
    puma = model_assets("puma560")
    assert puma.urdf_path.is_absolute()
    robot = yourdfpy.URDF.load(str(puma.urdf_path))
    assert robot.actuated_joint_names[:6] == [joint.name for joint in puma.model.joints]
    assert robot.actuated_joint_names[6:] == ["finger_left"]  # the other one follows
    assert sum(len(mesh.faces) for mesh in robot.scene.geometry.values()) > 7000


def test_assets_are_made_once_and_need_no_bullet() -> None:
    program = (
        "import sys; from app.robot.models import model_assets; print(model_assets('puma560')[1]);"
        "sys.exit('pybullet' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(model_assets("puma560").urdf_path)


@pytest.mark.parametrize("writable", [True, False])
def test_assets_are_built_anew_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writable: bool
) -> None:
    cache = tmp_path / "cache"
    if not writable:
        cache.write_text("a file where the cache folder would be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    made = model_assets.__wrapped__("puma560")
    meshes = [
        Path(mesh.get("filename", "")) for mesh in ElementTree.parse(made.urdf_path).iter("mesh")
    ]
    assert len(meshes) == 6
    for mesh in meshes:
        assert not mesh.is_absolute()
        assert (made.urdf_path.parent / mesh).is_file()
    assert (cache in made.urdf_path.parents) == writable
    assert not list(tmp_path.rglob(".new-*"))


def test_a_missing_mesh_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assets, "find_spec", lambda name: None)
    told = r"model.toml:3: .*puma560.urdf:\d+ names a mesh .*link0.stl' that is not there"
    with pytest.raises(CannotStart, match=told):
        model_assets.__wrapped__("puma560")


def test_stl_text_and_binary_are_read_alike(tmp_path: Path) -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 0, 2]]])
    text = "solid two\n" + "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"  vertex {x} {y} {z}\n" for x, y, z in triangle)
        + "endloop\nendfacet\n"
        for triangle in corners
    )
    (tmp_path / "text.stl").write_text(text + "endsolid two\n")
    (tmp_path / "binary.stl").write_bytes(write_stl(corners.astype(np.float32)))
    assert read_stl(tmp_path / "text.stl").tolist() == corners.tolist()
    assert read_stl(tmp_path / "binary.stl").tolist() == corners.tolist()


def test_triangles_without_area_are_left_out() -> None:
    corners = np.zeros((2, 3, 3), np.float32)
    corners[0] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert len(write_stl(corners)) == 84 + 50


def test_a_file_that_is_no_stl_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.stl").write_bytes(b"not a mesh" * 20)
    with pytest.raises(CannotStart, match=r"no.stl is not an STL file"):
        read_stl(tmp_path / "no.stl")


def raw_model() -> dict:
    return tomllib.loads((model_folder("puma560") / "model.toml").read_text("utf-8"))


def test_models_refuse_what_cannot_be() -> None:
    raw = raw_model()
    raw["poses"]["home"][4] = 3.0
    with pytest.raises(ValidationError, match=r"pose home: joint5 at 3.0 rad is outside"):
        Model.model_validate(raw)
    raw = raw_model()
    raw["poses"]["ready"] = [0.0]
    with pytest.raises(ValidationError, match=r"pose ready: 1 numbers for 6 joints"):
        Model.model_validate(raw)
    with pytest.raises(ValidationError, match=r"there is no pose elsewhere"):
        Model.model_validate(raw_model() | {"home": "elsewhere"})
    with pytest.raises(ValidationError, match=r"colour_of_hope"):
        Model.model_validate(raw_model() | {"colour_of_hope": 1})
    raw = raw_model()
    raw["objects"].append(raw["objects"][0])
    with pytest.raises(ValidationError, match=r"the same name twice"):
        Model.model_validate(raw)
    raw = raw_model()
    raw["joints"][0]["lower"] = 3.0
    with pytest.raises(ValidationError, match=r"joint1: lower 3.0 is not below upper 2.7925"):
        Model.model_validate(raw)


def test_things_stand_on_the_table_within_reach_and_apart() -> None:
    model = load_model("puma560")
    table = next(thing for thing in model.objects if thing.name == "table")
    top = table.position[2] + table.size[2] / 2
    loose = [thing for thing in model.objects if thing.mass > 0]
    assert len(loose) == 3
    assert len({thing.colour for thing in loose}) == 3
    for thing in loose:
        assert thing.position[2] - thing.size[2] / 2 == pytest.approx(top, abs=1e-3)
        assert max(thing.size[:2]) < model.gripper.width
        assert 0.3 < np.hypot(*thing.position[:2]) < 0.8
    for one in loose:
        for other in loose:
            if one is not other:
                assert np.hypot(*(np.array(one.position) - other.position)[:2]) > 0.09
