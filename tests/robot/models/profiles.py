"""A small robot of one's own: two joints, two fingers, a camera; and ways to get it wrong."""

from pathlib import Path

import numpy as np

from app.robot.models.assets import write_stl

LINK = """
  <link name="{0}">
    <inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
    </inertial>
    <visual><geometry>{1}</geometry></visual>
    <collision><geometry><box size="0.05 0.05 0.2"/></geometry></collision>
  </link>"""
JOINT = """
  <joint name="{0}" type="{1}">
    <parent link="{2}"/><child link="{3}"/><origin xyz="{4}"/><axis xyz="{5}"/>
    <limit lower="{6}" upper="{7}" velocity="2.0" effort="50"/>
  </joint>"""
URDF = (
    '<?xml version="1.0"?>\n<robot name="mine">'
    + LINK.format("base", '<mesh filename="package://mine/meshes/block.stl" scale="2 2 2"/>')
    + LINK.format("upper", '<box size="0.05 0.05 0.3"/>')
    + LINK.format("lower", '<mesh filename="meshes/block.obj"/>')
    + LINK.format("left", '<box size="0.01 0.01 0.05"/>')
    + LINK.format("right", '<box size="0.01 0.01 0.05"/>')
    + '\n  <link name="tip"/>'
    + JOINT.format("turn", "revolute", "base", "upper", "0 0 0.2", "0 0 1", "-2", "2")
    + JOINT.format("slide", "prismatic", "upper", "lower", "0 0 0.3", "1 0 0", "0", "0.4")
    + JOINT.format("one", "prismatic", "lower", "left", "0.1 0 0", "0 1 0", "0", "0.03")
    + JOINT.format("other", "prismatic", "lower", "right", "0.1 0 0", "0 -1 0", "0", "0.03")
    + '\n  <joint name="end" type="fixed"><parent link="lower"/><child link="tip"/>'
    '<origin xyz="0.15 0 0"/></joint>\n</robot>\n'
)
TOML = """\
name = "Mine"
urdf = "mine.urdf"
base_link = "base"
tool_link = "tip"
home = "home"

[[joints]]
name = "turn"
lower = -1.9
upper = 1.9
velocity = 1.0
acceleration = 8.0
jerk = 130.0
torque = 50.0
brake = 100.0

[[joints]]
name = "slide"
lower = 0.0
upper = 0.4
velocity = 0.3
acceleration = 2.5
jerk = 40.0
torque = 200.0
brake = 400.0

[gripper]
fingers = ["one", "other"]
width = 0.06
speed = 0.05
force = 20.0

[poses]
home = [0.0, 0.1]
out = [
  0.5,  # a comment with a ] in it
  0.3,
]

[[cameras]]
name = "scene"
link = "base"
eye = [1.5, -1.0, 1.0]
target = [0.0, 0.0, 0.3]
up = [0.0, 0.0, 1.0]
fov_degrees = 40
near = 0.1
far = 5.0
light = [0.5, -0.5, 1.0]

[[objects]]
name = "table"
shape = "box"
size = [0.4, 0.4, 0.02]
position = [0.6, 0.0, 0.1]
grid = true
colour = [0.7, 0.6, 0.4, 1.0]
"""
BOX_OBJ = """\
mtllib block.mtl
v 0 0 0
v 0.1 0 0
v 0 0.1 0
v 0 0 0.1
usemtl red
f 1 3 2
f 1 2 4
usemtl blue
f 1 4 3
f 2 3 4
"""
BOX_MTL = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n"


def write_profile(folder: Path, toml: str = TOML, urdf: str = URDF) -> Path:
    """Write the robot into a folder; returns its profile."""
    meshes = folder / "meshes"
    meshes.mkdir(parents=True)
    corners = np.array([[[0, 0, 0], [0, 0.1, 0], [0.1, 0, 0]], [[0, 0, 0], [0.1, 0, 0], [0, 0, 1]]])
    (meshes / "block.stl").write_bytes(write_stl(corners.astype(np.float32)))
    (meshes / "block.obj").write_text(BOX_OBJ)
    (meshes / "block.mtl").write_text(BOX_MTL)
    (folder / "mine.urdf").write_text(urdf)
    path = folder / "mine.toml"
    path.write_text(toml)
    return path
