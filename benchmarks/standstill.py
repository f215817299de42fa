"""How soon the arm stands when the process that drives it is killed at full speed.

Each time, a process of its own drives joint 1 at full speed and is killed (SIGKILL). Time is the
node's own: from the tick of the last command to the last state in which a joint was measured to
move faster than 0.02 rad/s. The target is 500 ms.
"""

import itertools
import subprocess
import sys
import time
from pathlib import Path

from app.link.actions import JogJoint, Pose
from app.link.gateway_end import GatewayEnd
from app.link.messages import State
from benchmarks.node_process import ROBOT, BenchNode, Driver
from benchmarks.report import arguments, percentiles, report

STANDING = 0.02
GIVE_UP_S = 20.0
FULL = 1.3
"""rad/s; joint 1 jogs at 95% of 1.43."""


def drive(endpoint: str, holder: str, direction: float) -> None:
    """The process that is killed."""
    driver = Driver(endpoint, holder)
    driver.ready()
    home = driver.end.describe(5).poses["home"][0]
    driver.show(Pose(name="home"), 1, lambda: abs(driver.state.joints[0] - home) < 1e-3)
    driver.show(None, 1, lambda: driver.state.mode == "armed")
    jog = JogJoint(joint=1, velocity=4.3 * direction)
    driver.show(jog, 2, lambda: False, lambda tick: print(tick, flush=True))


def at_full_speed(state: State | None) -> bool:
    """Whether the jog (and not the way home before it) runs at full speed."""
    jogs = state is not None and isinstance(state.action, JogJoint)
    return jogs and state is not None and abs(state.velocities[0]) > FULL


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--times", type=int, default=50, help="how often the driver is killed")
    parser.add_argument("--drive", nargs=3, metavar=("ENDPOINT", "HOLDER", "DIRECTION"))
    options = parser.parse_args()
    if options.drive:
        drive(options.drive[0], options.drive[1], float(options.drive[2]))
        return
    command = [sys.executable, "-m", "benchmarks.standstill", "--drive"]
    took: list[float] = []
    repeated = 0
    states: list[State] = []
    with BenchNode(cameras=False) as node, GatewayEnd(ROBOT, node.endpoint, states.append) as end:
        for number in itertools.count():
            if len(took) == options.times:
                break
            direction = 1 if number % 2 else -1
            driver = subprocess.Popen(
                [*command, node.endpoint, f"driver-{number}", str(direction)],
                stdout=subprocess.PIPE,
                text=True,
                cwd=Path(__file__).parents[1],
            )
            deadline = time.monotonic() + GIVE_UP_S
            while not at_full_speed(end.state) and time.monotonic() < deadline:
                time.sleep(0.002)
            fast = at_full_speed(end.state)
            driver.kill()
            assert driver.stdout is not None
            # The last line may be cut short by the kill; a command is sent after its line.
            lines = driver.stdout.read().split("\n")
            last = int(lines[-2]) if fast else 0
            driver.wait()
            if not fast:
                # On a busy machine the driver itself can fall silent; the watchdog then has
                # stopped the arm already, and there is nothing to measure.
                repeated += 1
                time.sleep(2.5)
                continue
            time.sleep(1.0)
            moving = [s.tick for s in states if max(map(abs, s.velocities)) > STANDING]
            took.append(float(moving[-1] - last))
            states.clear()
            while end.state is None or end.state.controller is not None:
                time.sleep(0.01)
    figures = {"last command to standstill, ms": percentiles(took)}
    figures["over 500 ms"] = {"times": float(sum(t > 500 for t in took))}
    figures["repeated, not at full speed"] = {"times": float(repeated)}
    report(figures, options)


if __name__ == "__main__":
    main()
