"""The simulated robot of a profile: an arm, or a base that drives."""

from app.robot.arm import Arm
from app.robot.models import model_assets
from app.robot.sim.arm import SimulatedArm
from app.robot.sim.base import SimulatedBase


def simulated(profile: str, robot: str, *, objects: bool = True) -> Arm:
    """The simulated robot of the profile ``profile`` (a name or a file).

    Raises:
        CannotStart: the profile is wrong, or PyBullet cannot run it.
    """
    assets = model_assets(profile)
    if assets.model.base is not None:
        return SimulatedBase(assets, robot, objects=objects)
    return SimulatedArm(profile, robot, objects=objects)
