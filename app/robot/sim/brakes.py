"""Brakes on joints: they rub while a joint turns, and hold it exactly once it stands.

Coulomb friction, joint by joint. Bullet finds in each step the torque that would bring the joint to
a standstill, up to the brake's. Where that takes all of the brake's torque, the brake slips and the
joint goes on. Where it takes less, the brake holds: the joint sticks at the angle where this was so
first.

Bullet's solver is iterative and comes to that standstill only nearly: with a heavy load a few
hundredths of a rad/s remain, whatever the brake's torque, and tyres creep on a floor. So what
sticks is put back to its place after each step, at rest, and what remains never adds up to a
motion. What pushes harder than the brakes or the tyres hold still moves it.
"""

import math
from collections.abc import Sequence

import pybullet

_SLIPPING = 0.999
"""Part of a brake's torque from which on it slips: the solver's limit is met but for rounding."""
_STANDING_M_S = 1e-3
_STANDING_RAD_S = 2e-3
"""A body on braked wheels that gets no faster than this within one step, from rest, is held by its
tyres: 0.24 m/s^2 more than they hold would move it."""

_STILL = (0.0, 0.0, 0.0)
_Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]


class Brakes:
    """The brakes of some joints of one body.

    Args:
        client: Number of the Bullet world.
        body: Number of the body.
        joints: Numbers of the joints, each with a brake of its own.
        torques: Nm (N where a joint slides), of each brake.
        wheels: The joints are the wheels on which the body stands.
    """

    def __init__(
        self,
        client: int,
        body: int,
        joints: Sequence[int],
        torques: Sequence[float],
        *,
        wheels: bool = False,
    ) -> None:
        self._client = client
        self._body = body
        self._joints = list(joints)
        self._torques = list(torques)
        self._wheels = wheels
        self._stuck: dict[int, float] = {}
        """Joint number to the angle (rad or m) at which its brake holds it."""
        self._parked: _Pose | None = None
        """Where a body on wheels stands."""
        self.engaged = False

    @property
    def holding(self) -> bool:
        """All are engaged and nothing slips."""
        return (
            self.engaged
            and len(self._stuck) == len(self._joints)
            and (self._parked is not None or not self._wheels)
        )

    def engage(self) -> None:
        """Motors off, brakes on."""
        self.engaged = True
        self._forget()
        pybullet.setJointMotorControlArray(
            self._body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[0.0] * len(self._joints),
            forces=self._torques,
            velocityGains=[1.0] * len(self._joints),
            physicsClientId=self._client,
        )

    def release(self) -> None:
        """Brakes off; the motors have to hold from now on."""
        self.engaged = False
        self._forget()

    def after_step(self) -> None:
        """Hold what stands. To be called after each step of the world."""
        if not self.engaged:
            return
        states = pybullet.getJointStates(self._body, self._joints, physicsClientId=self._client)
        for joint, limit, state in zip(self._joints, self._torques, states, strict=True):
            angle, speed, torque = state[0], state[1], state[3]
            if abs(torque) >= _SLIPPING * limit:
                self._stuck.pop(joint, None)
                continue
            held = self._stuck.setdefault(joint, angle)
            if angle != held or speed != 0.0:
                pybullet.resetJointState(self._body, joint, held, 0.0, physicsClientId=self._client)
        if self._wheels:
            self._park()

    def _park(self) -> None:
        """Hold the body where it stands, as long as its tyres do."""
        linear, angular = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        if (
            len(self._stuck) < len(self._joints)
            or math.hypot(*linear) > _STANDING_M_S
            or math.hypot(*angular) > _STANDING_RAD_S
        ):
            self._parked = None
            return
        if self._parked is None:
            self._parked = pybullet.getBasePositionAndOrientation(
                self._body, physicsClientId=self._client
            )
        pybullet.resetBasePositionAndOrientation(
            self._body, *self._parked, physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(self._body, _STILL, _STILL, physicsClientId=self._client)

    def _forget(self) -> None:
        self._stuck.clear()
        self._parked = None
