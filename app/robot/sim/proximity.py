"""How near an arm is to the things around it and to itself, at any joint angles.

Asked of a Bullet world of its own, in which no time passes: the same URDF, the same things, placed
where they were last measured. Distances are those of Bullet's GJK between the collision shapes
(``getClosestPoints``). Three rules make grasping possible without making it blind:

- What can move may come near to the *hand* (the fingers and the link that carries them) and touch
  it: to grasp a thing is no collision. To every other link it is an obstacle like the table.
- The hand is told apart from the arm (``Near.kind``), so that the fingers may come closer to what
  is fixed than an elbow: down to where a thing on a table can be grasped.
- What is *held*, by both fingers at once, is part of the arm: it goes where the hand goes, and its
  own distance to everything else counts, until it is let go.
"""

import itertools
from collections.abc import Iterable

import numpy as np
import pybullet

from app.link.messages import ObjectState
from app.robot.arm import Near, NearKind, Reading, Vector
from app.robot.models import ModelAssets
from app.robot.motion.reach import reach_of
from app.robot.sim.kinematics import SerialKinematics
from app.robot.sim.world import add_floor, add_object, connect, load_robot

FLOOR = "floor"
_MOVED = 2e-4
"""m; things and fingers that have moved less than this stay where they are in this world."""
_AROUND = 0.15
"""m; one look farther out serves for all joints from which no point travels farther than this."""
_TURNED = 2e-3
"""The same for a quaternion's components: 0.2 mm at 50 mm."""
_SETTLED = 1e-5
"""m; what is held and has moved less in the hand is where it was. Finer than the guard's leeway: a
thing that stands on another one may not seem to sink into it by the first step of the way out."""
_TILTED = 1e-4
"""The same for a quaternion's components: 10 um at 50 mm."""

Pose = tuple[tuple[float, ...], tuple[float, ...]]
"""m, and quaternion x, y, z, w."""


class SimulatedProximity:
    """Implements :class:`app.robot.arm.Proximity` for the arm of a model.

    Args:
        assets: The model, with its URDF.
        objects: Whether floor, table and things are there.

    Raises:
        CannotStart: PyBullet cannot load the URDF, or has no free world.
    """

    def __init__(self, assets: ModelAssets, *, objects: bool = True) -> None:
        model = assets.model
        self._words = model.link_words
        self.client = connect()
        self._open = True
        self._body, joints, links = load_robot(self.client, assets.urdf_path)
        self._names = {index: name for name, index in links.items()}
        self._joints = [joints[joint.name] for joint in model.joints]
        gripper = model.gripper
        self._fingers = [joints[name] for name in gripper.fingers] if gripper else []
        parents, self._depths = self._tree(set(self._joints))
        # Without fingers there is no hand: nothing is held, and everything has to keep clear.
        self._palm = parents[self._fingers[0]] if gripper else -1
        self._hand = {self._palm, *self._fingers} if gripper else set()
        self._still = {index for index, depth in self._depths.items() if depth == 0}
        self._pairs = self._self_pairs(links, set(map(frozenset, model.never_touch)))
        self._fixed: dict[int, str] = {}
        self._movable: dict[str, int] = {}
        if objects:
            self._fixed[add_floor(self.client)] = FLOOR
            for thing in model.objects:
                body = add_object(self.client, thing)
                if thing.mass > 0:
                    self._movable[thing.name] = body
                else:
                    self._fixed[body] = thing.name
        self._things = self._fixed | {body: name for name, body in self._movable.items()}
        self._movable_bodies = set(self._movable.values())
        kinematics = SerialKinematics(assets.urdf_path, model.base_link, model.tool_link)
        self._reach = reach_of(kinematics, len(self._joints))
        self._looked: Vector | None = None
        """rad; where all things and pairs were last looked at, and ``_within`` (m) how far out."""
        self._within = 0.0
        self._around: list[int] = []
        """The things that came up there; no other can be within reach."""
        self._around_pairs: list[tuple[int, int]] = []
        self._placed: dict[str, tuple[Vector, Vector]] = {}
        self._width = -1.0
        self._held: str | None = None
        self._in_hand: Pose | None = None
        """Where the held thing is in the palm's frame: m, and a quaternion x, y, z, w."""

    @property
    def self_pairs(self) -> tuple[tuple[str, str], ...]:
        """The pairs of the arm's own links that are asked about."""
        return tuple((self._names[a], self._names[b]) for a, b in self._pairs)

    def plain(self, name: str) -> str:
        """A link or thing in plain words."""
        return self._words.get(name, name.replace("_", " "))

    def follow(self, reading: Reading, *, standing: bool) -> bool:
        """Put fingers and things where ``reading`` says; see :class:`app.robot.arm.Proximity`."""
        changed = abs(reading.gripper - self._width) > _MOVED
        if changed:
            self._width = reading.gripper
            for finger in self._fingers:
                pybullet.resetJointState(
                    self._body, finger, reading.gripper / 2, physicsClientId=self.client
                )
        if reading.held != self._held or (self._held is not None and standing):
            self._held = reading.held if reading.held in self._movable else None
            in_hand = self._grasp(reading) if self._held is not None else None
            if not _alike(in_hand, self._in_hand):
                self._in_hand = in_hand
                changed = True
        for thing in reading.objects:
            if thing.name != self._held and thing.name in self._movable:
                changed |= self._put(thing)
        if changed:
            self._looked = None
        return bool(changed)

    def near(self, joints: Vector, within: float) -> list[Near]:
        """What is nearer than ``within`` (m) with the joints at ``joints`` (rad, shape (n,))."""
        client, body, hand = self.client, self._body, self._hand
        self._look_around(joints, within)
        self._place(joints)
        found: dict[tuple[str, str], Near] = {}
        held = self._movable[self._held] if self._held is not None else None
        for thing in self._around:
            if thing == held:
                continue
            name = self._things[thing]
            movable = thing in self._movable_bodies
            for point in pybullet.getClosestPoints(body, thing, within, physicsClientId=client):
                link = point[3]
                if link in self._still or (movable and link in hand):
                    continue
                kind: NearKind = "hand" if link in hand else "scene"
                points, moves = (point[5], point[6]), (0, self._depths[link])
                _keep(found, Near(kind, self._names[link], name, point[8], points, moves))
        for first, second in self._around_pairs:
            for point in pybullet.getClosestPoints(
                body, body, within, first, second, physicsClientId=client
            ):
                on_first, on_second = point[5:7] if point[3] == first else point[6:4:-1]
                link, other = self._names[second], self._names[first]
                between = sorted((self._depths[first], self._depths[second]))
                moves = between[0], between[1]
                _keep(found, Near("itself", link, other, point[8], (on_second, on_first), moves))
        if held is not None and self._held is not None:
            self._carry(held)
            for thing, name in self._things.items():
                if thing != held:
                    for point in pybullet.getClosestPoints(
                        held, thing, within, physicsClientId=client
                    ):
                        points = point[5], point[6]
                        moves = 0, self._depths[self._palm]
                        _keep(found, Near("held", self._held, name, point[8], points, moves))
            for point in pybullet.getClosestPoints(held, body, within, physicsClientId=client):
                # Not the hand that holds it, nor the joint that carries the hand.
                if self._depths[point[4]] < self._depths[self._palm] - 1:
                    points, other = (point[5], point[6]), self._names[point[4]]
                    moves = self._depths[point[4]], self._depths[self._palm]
                    _keep(found, Near("itself", self._held, other, point[8], points, moves))
        return list(found.values())

    def close(self) -> None:
        """Give the Bullet world back. Closing twice does no harm."""
        if self._open:
            self._open = False
            pybullet.disconnect(self.client)

    def _tree(self, moving: set[int]) -> tuple[dict[int, int], dict[int, int]]:
        """The parent of each link, and how many of the arm's joints lie between it and the base."""
        parents = {-1: -1}
        depths = {-1: 0}
        for index in range(pybullet.getNumJoints(self._body, physicsClientId=self.client)):
            parent = pybullet.getJointInfo(self._body, index, physicsClientId=self.client)[16]
            parents[index] = parent
            depths[index] = depths[parent] + (index in moving)
        return parents, depths

    def _self_pairs(
        self, links: dict[str, int], never: set[frozenset[str]]
    ) -> list[tuple[int, int]]:
        """Pairs of links that can meet: with shapes, and more than one joint of the arm between."""
        solid = [
            (name, index)
            for name, index in links.items()
            if pybullet.getCollisionShapeData(self._body, index, physicsClientId=self.client)
        ]
        return [
            (a, b)
            for (first, a), (second, b) in itertools.combinations(solid, 2)
            if abs(self._depths[a] - self._depths[b]) > 1
            and frozenset((first, second)) not in never
        ]

    def _look_around(self, joints: Vector, within: float) -> None:
        """Find out what can be within reach at all, unless that is known from nearby."""
        if (
            self._looked is not None
            and within <= self._within
            and np.abs(joints - self._looked) @ self._reach < _AROUND
        ):
            return
        self._place(joints)
        body, client, far = self._body, self.client, within + _AROUND
        self._looked, self._within = joints.copy(), within
        self._around = [
            thing
            for thing in self._things
            if any(
                point[3] not in self._still
                for point in pybullet.getClosestPoints(body, thing, far, physicsClientId=client)
            )
        ]
        self._around_pairs = [
            pair
            for pair in self._pairs
            if pybullet.getClosestPoints(body, body, far, *pair, physicsClientId=client)
        ]

    def _place(self, joints: Vector) -> None:
        pybullet.resetJointStatesMultiDof(
            self._body, self._joints, joints[:, None].tolist(), physicsClientId=self.client
        )

    def _put(self, thing: ObjectState) -> bool:
        """Put a thing where it is; whether it had moved."""
        position, turn = np.array(thing.position), np.array(thing.orientation)
        before = self._placed.get(thing.name)
        if (
            before is not None
            and np.abs(before[0] - position).max() < _MOVED
            and np.abs(before[1] - turn).max() < _TURNED
        ):
            return False
        self._placed[thing.name] = position, turn
        w, x, y, z = thing.orientation
        pybullet.resetBasePositionAndOrientation(
            self._movable[thing.name],
            thing.position,
            (x, y, z, w),
            physicsClientId=self.client,
        )
        return True

    def _grasp(self, reading: Reading) -> Pose | None:
        """Where the held thing is in the palm's frame, both as measured."""
        for thing in reading.objects:
            if thing.name == self._held:
                self._placed.pop(thing.name, None)  # let go, it is put anew
                self._place(reading.joints)
                w, x, y, z = thing.orientation
                inverse = pybullet.invertTransform(*self._palm_pose())
                position, turn = pybullet.multiplyTransforms(*inverse, thing.position, (x, y, z, w))
                return tuple(position), tuple(turn)
        return None

    def _palm_pose(self) -> Pose:
        state = pybullet.getLinkState(
            self._body, self._palm, computeForwardKinematics=True, physicsClientId=self.client
        )
        return state[4], state[5]

    def _carry(self, held: int) -> None:
        """Put what is held where the hand has it."""
        if self._in_hand is not None:
            position, turn = pybullet.multiplyTransforms(*self._palm_pose(), *self._in_hand)
            pybullet.resetBasePositionAndOrientation(
                held, position, turn, physicsClientId=self.client
            )


def _alike(one: Pose | None, other: Pose | None) -> bool:
    """Whether two poses are the same, but for the trembling of a simulated grasp."""
    if one is None or other is None:
        return one is other
    return bool(
        np.abs(np.subtract(one[0], other[0])).max() < _SETTLED
        and np.abs(np.subtract(one[1], other[1])).max() < _TILTED
    )


def always_near(
    proximity: SimulatedProximity, poses: Iterable[Vector], within: float
) -> dict[tuple[str, str], tuple[float, float]]:
    """For each pair of the arm's own links: the least and the largest distance (m) over ``poses``.

    For making a profile: a pair that is nearer than the stop distance at every pose, or that never
    comes near, belongs in ``never_touch``. Distances over ``within`` count as infinite.
    """
    pairs = {frozenset(pair): pair for pair in proximity.self_pairs}
    spans = {pair: (np.inf, -np.inf) for pair in pairs.values()}
    for joints in poses:
        seen = dict.fromkeys(pairs.values(), np.inf)
        for near in proximity.near(joints, within):
            if near.kind == "itself":
                seen[pairs[frozenset((near.link, near.thing))]] = near.distance
        for pair, distance in seen.items():
            low, high = spans[pair]
            spans[pair] = min(low, distance), max(high, distance)
    return spans


def _keep(found: dict[tuple[str, str], Near], near: Near) -> None:
    """Keep the nearest points of each pair: links may have several shapes."""
    pair = near.link, near.thing
    if pair not in found or near.distance < found[pair].distance:
        found[pair] = near
