"""A hundred thousand random commands: is a limit ever broken at the commanded joints?

A real controller with the real geometry of arm and scene, without physics: the arm goes exactly
where it is told, as fast as the machine can. Commands are of every kind, large, tiny, alternating,
let go in the middle, of old epochs and repeated; stops come in between; a part are not even
messages (NaN, infinity, beyond every bound) and must be refused at the border. After every cycle
position, velocity, acceleration, jerk, workspace and every distance are checked:

    python -m benchmarks.random_commands --commands 100000
"""

import json
import random
import time
from collections import Counter

import numpy as np
from pydantic import ValidationError

from app.config import ArmMotionSettings
from app.link.messages import Command, LeaseRequest, StopRequest
from app.robot.arm import Reading, Vector
from app.robot.controller import DT, Controller, tick_of
from app.robot.latch import StopLatch
from app.robot.models import model_assets
from app.robot.sim.kinematics import SerialKinematics
from app.robot.sim.proximity import SimulatedProximity
from benchmarks.report import arguments, report

_HUGE = (1e6, -1e6, 1e30, -1e300)
_TINY = (1e-12, -1e-9, 1e-6, 5e-324)
_ROUNDING = 2e-4
"""m; distances are Bullet's, and count as the same within this."""


class StillArm:
    """Implements :class:`app.robot.arm.Arm` without physics: it is where it was told to be."""

    def __init__(self, model: str) -> None:
        assets = model_assets(model)
        self.model = assets.model
        self.description = assets.describe("bench")
        self.home: Vector = self.model.pose(self.model.home)
        self.kinematics = SerialKinematics(
            assets.urdf_path, self.model.base_link, self.model.tool_link
        )
        self.proximity = SimulatedProximity(assets)
        self.joints, self.velocities = self.home.copy(), np.zeros(len(self.home))
        self.width = self.wanted = self.description.gripper_max

    def read(self) -> Reading:
        """Where it is."""
        tool = self.kinematics.forward(self.joints)
        return Reading(self.joints.copy(), self.velocities.copy(), self.width, tool, ())

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Be there."""
        self.joints, self.velocities = joints.copy(), velocities.copy()

    def grip(self, width: float, force: float | None = None) -> None:
        """Move the fingers."""
        self.wanted = width

    def brake(self, engaged: bool) -> None:
        """Stand."""
        self.velocities = np.zeros(len(self.joints))

    def step(self) -> None:
        """Let 1/240 s pass."""
        gripper = self.model.gripper
        most = 2 * gripper.speed * DT if gripper else 0.0
        self.width += float(np.clip(self.wanted - self.width, -most, most))

    def reset_scene(self) -> None:
        """Nothing here moves by itself."""

    def close(self) -> None:
        """Give the Bullet world back."""
        self.proximity.close()


class Fuzz:
    """Sends random commands to a controller and checks every cycle.

    Args:
        seed: Of the random numbers.
        model: Of the robot.
    """

    def __init__(self, seed: int, model: str = "puma560") -> None:
        self.rng = random.Random(seed)
        self.arm = StillArm(model)
        self.now = 1000.0
        self.controller = Controller(
            self.arm, "bench", ArmMotionSettings(), StopLatch(None), self.now
        )
        self.counts: Counter[str] = Counter()
        self.broken: Counter[str] = Counter()
        self.examples: dict[str, str] = {}
        self.least = {"scene": np.inf, "hand": np.inf, "itself": np.inf, "workspace": np.inf}
        """m; the smallest distance above its stop distance of each kind."""
        self.part = {"velocity": 0.0, "acceleration": 0.0, "jerk": 0.0}
        """The largest part of each limit that was used."""
        self._epoch = 0
        self._sequence = 0
        self._hold = 0
        self._ready()

    def close(self) -> None:
        """Let go of the arm."""
        self.arm.close()

    def command(self) -> None:
        """One random command, and some cycles."""
        rng = self.rng
        text = json.dumps(self._message(), allow_nan=True)
        commands = []
        try:
            commands.append(Command.model_validate_json(text))
            self.counts["obeyable"] += 1
        except ValidationError:
            self.counts["refused at the border"] += 1
        if any(word in text for word in ("NaN", "Infinity")) and commands:
            self._broke("border", f"{text} was let in")
        self._cycle(commands)
        for _ in range(rng.choice((0, 0, 1, 3, 8, 8, 8, 20))):
            self._cycle([])
        chance = rng.random()
        if commands and chance > 0.97:
            self._keep(commands[0])
        if chance < 0.015:
            category = rng.choice(("S0", "S1", "S2"))
            self.controller.stop(StopRequest(category=category, source="bench", reason="fuzz"))
            self.counts[f"stop {category}"] += 1
        if not self.controller.safety.may_move and (chance > 0.5 or self._sequence % 7 == 0):
            self._ready()

    def _keep(self, command: Command) -> None:
        """Go on showing the same for up to a second and a half."""
        for count in range(self.rng.randint(40, 360)):
            if count % 8 == 0:
                self._sequence = max(self._sequence, command.sequence) + 1
                new = {"sequence": self._sequence, "tick": tick_of(self.now)}
                self._cycle([command.model_copy(update=new)])
            else:
                self._cycle([])

    def _ready(self) -> None:
        """Come to rest, reset, arm, and show nothing for half a second."""
        for _ in range(60):
            self._cycle([])
        for kind in ("reset", "take", "arm"):
            reply = self.controller.answer(
                LeaseRequest(kind=kind, holder="bench", epoch=self._epoch), self.now
            )
            if kind == "take" and reply.epoch is not None:
                self._epoch = reply.epoch
        for count in range(130):
            self._sequence += 1
            nothing = Command(
                epoch=self._epoch, sequence=self._sequence, tick=tick_of(self.now), hold=self._hold
            )
            self._cycle([nothing] if count % 8 == 0 else [])

    def _message(self) -> dict[str, object]:
        rng = self.rng
        self._sequence += rng.choice((1, 1, 1, 1, 1, 1, 1, 1, 0, -3))
        if rng.random() < 0.5:
            self._hold += 1
        message: dict[str, object] = {
            "epoch": self._epoch + rng.choice((0,) * 30 + (1, -1)),
            "sequence": max(0, self._sequence),
            "tick": tick_of(self.now) - rng.choice((0,) * 30 + (100, 400, 10**6)),
            "hold": self._hold,
            "scale": rng.choice((1.0, 1.0, 1.0, 0.1, 0.5)),
        }
        if rng.random() < 0.85:
            action = self._action()
            self.counts[str(action["type"])] += 1
            message |= {"gesture": "fuzz", "action": action}
        return message

    def _value(self, most: float) -> float:
        rng = self.rng
        kind = rng.random()
        if kind < 0.01:
            return rng.choice((float("nan"), float("inf"), float("-inf")))
        if kind < 0.02:
            return rng.choice(_HUGE)
        if kind < 0.08:
            return rng.choice(_TINY)
        if kind < 0.4:
            return rng.choice((-most, most))
        return rng.uniform(-most, most)

    def _three(self, most: float) -> list[float]:
        return [self._value(most) if self.rng.random() < 0.6 else 0.0 for _ in range(3)]

    def _action(self, *, deep: bool = True) -> dict[str, object]:
        rng, joints = self.rng, len(self.arm.home)
        kinds = ["jog_joint", "jog_cartesian", "jog_joint", "jog_cartesian", "turn_joint"]
        kinds += ["move_linear", "pose", "home", "gripper"] + (["sequence"] if deep else ["wait"])
        action: dict[str, object]
        match kind := rng.choice(kinds):
            case "jog_joint":
                action = {"joint": rng.randint(1, joints), "velocity": self._value(4.3)}
            case "jog_cartesian":
                frame = rng.choice(("base", "tool"))
                action = {"frame": frame, "linear": self._three(1.0), "angular": self._three(3.1)}
            case "turn_joint":
                action = {"joint": rng.randint(1, joints), "angle": self._value(6.3)}
            case "move_linear":
                frame = rng.choice(("base", "tool"))
                action = {"frame": frame, "offset": self._three(0.5), "rotation": self._three(1.5)}
            case "pose":
                action = {"name": rng.choice([*self.arm.description.poses, "moon"])}
            case "gripper":
                action = {"width": abs(self._value(0.2))}
            case "wait":
                action = {"duration": 0.05}
            case "sequence":
                action = {"steps": [self._action(deep=False) for _ in range(rng.randint(1, 4))]}
            case _:
                action = {}
        if not deep and kind.startswith("jog"):
            action["duration"] = rng.choice((0.05, 0.3, 1.0))
        return {"type": kind, **action}

    def _cycle(self, commands: list[Command]) -> None:
        before = self.controller.motion.trajectory.now
        self.now += DT
        self.controller.cycle(self.now, commands)
        self.counts["cycles"] += 1
        motion = self.controller.motion
        now, limits = motion.trajectory.now, motion.trajectory.limits
        self._check(
            "position",
            float(np.maximum(now.position - limits.upper, limits.lower - now.position).max()),
            1e-6,
        )
        used = {
            "velocity": np.abs(now.velocity) / limits.stop.velocity,
            "acceleration": np.abs(now.acceleration) / limits.stop.acceleration,
        }
        if not self.controller.braked:  # brakes take the speed by themselves
            jerk = np.abs(now.acceleration - before.acceleration) / DT
            used["jerk"] = jerk / limits.stop.jerk
        for name, parts in used.items():
            self.part[name] = max(self.part[name], float(parts.max()))
            self._check(name, float(parts.max()), 1.001)
        if now.position is before.position:
            return
        # The step alone is judged: both distances with the fingers, and what they hold, where they
        # are now. How near fingers come by opening and closing is a matter of force (contact.py).
        last = {
            each.pair: each.distance - each.stop for each in motion.guard.margins(before.position)
        }
        for margin in motion.guard.margins(now.position):
            room = margin.distance - margin.stop
            floor = min(0.0, last.get(margin.pair, 0.0))
            if margin.kind in self.least and floor == 0.0:
                self.least[margin.kind] = min(self.least[margin.kind], room)
            self._check(f"distance ({margin.kind})", floor - room, _ROUNDING, str(margin))

    def _check(self, what: str, value: float, most: float, detail: str = "") -> None:
        if not value <= most:  # also NaN
            self._broke(what, f"{value} over {most} {detail}")

    def _broke(self, what: str, text: str) -> None:
        self.broken[what] += 1
        self.examples.setdefault(what, f"cycle {self.counts['cycles']}: {text}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--commands", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--model", default="puma560")
    options = parser.parse_args()
    fuzz = Fuzz(options.seed, options.model)
    began = time.monotonic()
    for number in range(1, options.commands + 1):
        fuzz.command()
        if number % 5000 == 0:
            print(f"{number} commands, {sum(fuzz.broken.values())} broken", flush=True)
    report(
        {
            "commands": {"sent": options.commands} | dict(sorted(fuzz.counts.items())),
            "limits broken": {"in all": sum(fuzz.broken.values())} | dict(fuzz.broken),
            "part of the limit used": fuzz.part,
            "room left, mm": {kind: 1000 * room for kind, room in fuzz.least.items()},
            "time": {"s": time.monotonic() - began},
        },
        options,
    )
    for what, text in fuzz.examples.items():
        print(f"{what}: {text}")
    fuzz.close()


if __name__ == "__main__":
    main()
