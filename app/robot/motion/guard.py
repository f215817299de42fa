"""Distances and the tool's workspace, kept whatever the task.

The same invariant as for the joints' limits: *braking now would end, and pass, outside the stop
distances*. Every step that a task takes is tried: if braking from there would come too near to
something, the step is taken back and the arm brakes along the path that was checked one step
before. So a stop that comes from elsewhere (let go, S2) finds a checked path, too.

The braking path is looked at from point to point. No point of the arm can travel farther than ::

    sum_i |dq_i| r_i,       r_i = the largest distance that it can have from the axis of joint i

so that a stretch no longer than the room left needs no look in between (conservative advancement,
B. Mirtich, "Timewarp rigid body simulation", SIGGRAPH 2000, and before).

Before the stop distance the arm is slowed: with ``d`` the distance at which braking now would end,
the part ``sqrt((d - stop) / (slow - stop))`` of the speed is left, the curve of a constant
deceleration. Only coming nearer is slowed or stopped. From inside a stop distance (a thing was put
there) every way out is open: then the distance that there is takes the place of the stop distance.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from app.config import ClearanceSettings
from app.link.messages import Clearance, WorkspaceDescription
from app.robot.arm import Kinematics, NearKind, Proximity, Reading, Vector
from app.robot.motion.at_work import AtWork, LimitKind
from app.robot.motion.reach import reach_of
from app.robot.motion.trajectory import JointTrajectory

_LEEWAY = 1e-4
"""m; less than this is rounding of Bullet's distances, not coming nearer."""
_RESERVE = 5e-4
"""m; kept above the stop distance: a hard stop's path is not quite that of ordinary braking."""
_STRIDE = 0.012
"""m; looks along the braking path are no closer. Between two looks that are clear by 10 mm or by
4 mm on both sides, nothing thicker than 4 mm is missed."""
_LOOKS = 6
"""Most looks along one braking path; where more are needed, the arm is slowed until they do."""
_SETTLED = 1e-5
"""m; braking that covers less than this ends where it is."""
_RISE = 2.0
"""1/s; how fast the pace comes back after slowing, lest it flutter."""
_CALM = 0.97
"""By this the pace falls in each cycle in which one path needs too many looks."""
_EVERY = 4
"""Cycles between two looks round a standing arm to which things come."""


class Margin(NamedTuple):
    """One thing to keep off."""

    kind: NearKind | Literal["workspace"]
    link: str
    thing: str
    distance: float
    """m"""
    stop: float
    """m; at which the arm stops"""
    slow: float
    """m; from which it is slowed"""
    joints: slice
    """Those that change the distance."""

    @property
    def pair(self) -> tuple[str, str]:
        """Which two."""
        return self.link, self.thing


class Guard:
    """Watches over one trajectory.

    Args:
        proximity: Tells what is near; None where that cannot be known.
        kinematics: Of the arm.
        workspace: The tool's box; None where it is not bounded.
        settings: The distances.
        count: How many joints the arm has.
    """

    def __init__(
        self,
        proximity: Proximity | None,
        kinematics: Kinematics,
        workspace: WorkspaceDescription | None,
        settings: ClearanceSettings,
        count: int,
    ) -> None:
        self._proximity = proximity
        self._kinematics = kinematics
        self._workspace = workspace
        self._settings = settings
        self._stops = {
            "scene": settings.stop,
            "hand": settings.stop_hand,
            "held": settings.stop_held,
            "itself": settings.stop_itself,
        }
        self.reach = reach_of(kinematics, count)
        """m, shape (n,): how far any point of the arm can be from each joint's axis."""
        self.scale = 1.0
        """Part of its speed that a task may use, 0 to 1."""
        self.clearance: Clearance | None = None
        """What is nearest, where the joints are commanded to be."""
        self.limits: tuple[str, ...] = ()
        """What slows or stops the arm, in plain words."""
        self._floors: dict[tuple[str, str], float] = {}
        """m; of the pairs that are nearer than their stop distance already."""
        self._here: Vector | None = None
        """Where the distances were last asked for."""
        self._since = 0

    @property
    def active(self) -> bool:
        """There is anything to watch."""
        return self._proximity is not None or self._workspace is not None

    def plain(self, name: str) -> str:
        """A link or thing in plain words."""
        return self._proximity.plain(name) if self._proximity is not None else name

    def watch(self, reading: Reading, joints: Vector, *, standing: bool) -> None:
        """Look round before a step: things may have moved, or the arm without our doing.

        Args:
            reading: As measured.
            joints: rad, shape (n,); where the joints are commanded to be.
            standing: The arm stands.
        """
        self._since += 1
        if standing:
            self.scale = 1.0
        if self._proximity is None:
            changed = False
        else:
            changed = self._proximity.follow(reading, standing=standing)
        moved = self._here is None or np.abs(joints - self._here).max() > 1e-5
        if (changed or moved) and (not standing or moved or self._since >= _EVERY):
            self._look_round(joints, standing=standing)

    def margins(self, joints: Vector) -> list[Margin]:
        """Everything within slowing distance, with the joints at ``joints`` (rad, shape (n,))."""
        return self._ask(joints)[0]

    def room(self, margins: list[Margin], extra: float = 0.0) -> float:
        """How far (m) every point of the arm may travel before something is too near.

        Negative when something is; ``extra`` (m) is added to every stop distance, but where the
        arm is nearer already.
        """
        return min(
            [self._unseen - extra, *(each.distance - self._needed(each, extra) for each in margins)]
        )

    def nearest_at(self, joints: Vector) -> str | None:
        """What is nearest to its stop distance with the joints at ``joints`` (rad, shape (n,)).

        In plain words; None when nothing is near.
        """
        margins = self.margins(joints)
        if not margins:
            return None
        return self._tell(min(margins, key=lambda each: each.distance - self._needed(each)))

    @property
    def _unseen(self) -> float:
        """How far (m) what is not within slowing distance is from where it stops the arm."""
        settings = self._settings
        unseen = settings.slow - max(self._stops.values()) - _RESERVE
        if self._workspace is not None:
            unseen = min(unseen, settings.slow_workspace - _RESERVE)
        return unseen

    def _stride(self, margins: list[Margin], travels: Vector) -> float:
        """The part of a braking path that may be passed before looking again, 0 to 1 and more.

        ``travels`` (m, shape (n,)) is how far any point may travel by each joint on all of it. Two
        links come no nearer by a joint that moves both.
        """
        parts = [max(self._unseen, _STRIDE) / float(travels.sum())]
        for each in margins:
            if (travel := float(travels[each.joints].sum())) > _SETTLED:
                parts.append(max(each.distance - self._needed(each), _STRIDE) / travel)
        return min(parts)

    def allows(self, trajectory: JointTrajectory) -> bool:
        """Whether the step that ``trajectory`` has just taken may stand.

        If not, ``limits`` says why. If so, ``scale`` is what the next step may use.
        """
        here, clearance = self._ask(trajectory.position)
        if self._too_near(here):
            return False
        before = {margin.pair: margin.distance for margin in here}
        there, part, why = here, 1.0, ""
        profile = trajectory.braking()
        duration = profile.duration
        end = np.array(profile.at_time(duration)[0])
        travels = np.abs(end - trajectory.position) * self.reach
        travel = float(travels.sum())
        done = 0.0 if travel > _SETTLED else 1.0
        looks = 0
        while done < 1.0:
            looks += 1
            step = self._stride(there, travels)
            if looks == _LOOKS and done + step < 1.0:
                part, why = self.scale * _CALM, "slowed: close to many things"
                step = 1.0
            done = min(1.0, done + step)
            # Deceleration is nearly constant: the part 1 - (1 - t)^2 of the way is covered.
            at = duration * (1.0 - math.sqrt(1.0 - done))
            there = self.margins(np.array(profile.at_time(at)[0]))
            if self._too_near(there):
                return False
            for margin in there:
                left = self._left(margin, before, travel)
                if left < part:
                    part, why = left, f"slowed: {self._tell(margin)}"
        if travel > _SETTLED and self.room(there) < _STRIDE:
            hard = trajectory.braking(hard=True)
            if self._too_near(self.margins(np.array(hard.at_time(hard.duration)[0]))):
                return False
        part = max(part, self._settings.slowest)
        self.scale = min(part, self.scale + _RISE * trajectory.dt)
        self.limits = (AtWork(why, "slowed"),) if why else ()
        self._accept(trajectory.position, here, clearance)
        return True

    def _look_round(self, joints: Vector, *, standing: bool) -> None:
        margins, clearance = self._ask(joints)
        # A thing that has settled by less than the leeway must not use it all up: the first step
        # of the way out would then be a hair too near, and no way would be open.
        settled = _LEEWAY / 2 if standing else _LEEWAY
        for margin in margins:
            floor = self._floors.get(margin.pair)
            # Nearer than any step of ours left it: the thing has moved, or the arm by itself.
            if margin.distance < (margin.stop + _RESERVE if floor is None else floor - settled):
                self._floors[margin.pair] = margin.distance
        self._since = 0
        self._accept(joints, margins, clearance)

    def _accept(self, joints: Vector, margins: list[Margin], clearance: Clearance | None) -> None:
        """The arm is at ``joints``: what is away from its stop distance has no floor any more."""
        floors = {}
        for margin in margins:
            floor = self._floors.get(margin.pair)
            if floor is not None and margin.distance < margin.stop + _RESERVE:
                floors[margin.pair] = max(floor, margin.distance)
        self._floors = floors
        self._here, self.clearance = joints.copy(), clearance

    def _ask(self, joints: Vector) -> tuple[list[Margin], Clearance | None]:
        slow = self._settings.slow
        found: list[Margin] = []
        nearest: Clearance | None = None
        if self._proximity is not None:
            nears = self._proximity.near(joints, slow)
            found = [
                Margin(
                    n.kind, n.link, n.thing, n.distance, self._stops[n.kind], slow, slice(*n.joints)
                )
                for n in nears
            ]
            if nears:
                near = min(nears, key=lambda each: each.distance)
                # Made 240 times a second, of values that need no checking.
                nearest = Clearance.model_construct(
                    distance=near.distance,
                    link=near.link,
                    thing=near.thing,
                    itself=near.kind == "itself",
                    points=near.points,
                )
        if self._workspace is not None:
            found += self._edges(self._kinematics.forward(joints).position)
        return found, nearest

    def _edges(self, tool: Vector) -> list[Margin]:
        assert self._workspace is not None
        slow = self._settings.slow_workspace
        sides = (self._workspace.lower, self._workspace.upper)
        found = []
        for axis, at in enumerate(tool.tolist()):
            for side, edge in enumerate(sides):
                distance = edge[axis] - at if side else at - edge[axis]
                if distance < slow:
                    name = f"{'xyz'[axis]} {'upper' if side else 'lower'}"
                    every = slice(None)
                    found.append(Margin("workspace", "tool", name, distance, 0.0, slow, every))
        return found

    def _needed(self, margin: Margin, extra: float = 0.0) -> float:
        """The distance (m) that must be kept."""
        wanted = margin.stop + _RESERVE + extra
        floor = self._floors.get(margin.pair)
        return wanted if floor is None else min(wanted, floor - _LEEWAY)

    def _too_near(self, margins: list[Margin]) -> bool:
        for margin in margins:
            if margin.distance < self._needed(margin):
                kind: LimitKind = "workspace" if margin.kind == "workspace" else "collision"
                self.limits = (AtWork(f"stopped: {self._tell(margin)}", kind),)
                return True
        return False

    def _left(self, margin: Margin, before: dict[tuple[str, str], float], travel: float) -> float:
        """The part of the speed that ``margin`` leaves, somewhere on a way of ``travel`` (m)."""
        nearer = before.get(margin.pair, margin.slow) - margin.distance
        # Going along something is not coming nearer: wholly slowed from a third of the way on.
        closing = min(1.0, max(0.0, nearer / travel - 0.02) * 3.0)
        span = max(margin.slow - margin.stop, 1e-6)
        left = math.sqrt(min(1.0, max(0.0, margin.distance - self._needed(margin)) / span))
        return 1.0 - closing * (1.0 - left)

    def _tell(self, margin: Margin) -> str:
        millimetres = max(0.0, 1000 * margin.distance)
        if margin.kind == "workspace":
            return f"tool is {millimetres:.0f} mm from the edge of its workspace ({margin.thing})"
        link, thing = self.plain(margin.link), self.plain(margin.thing)
        whose = "its own" if margin.kind == "itself" else "the"
        return f"{link} is {millimetres:.0f} mm from {whose} {thing}"
