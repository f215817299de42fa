"""Whether a profile fits its URDF: one small function a rule."""

from xml.etree import ElementTree

from app.robot.models.model import AtKey, Model
from app.robot.models.urdf import Urdf, UrdfJoint

ROOM = "room"
"""The link of a camera that stands still in the room."""
_ROUNDING = 1e-3
"""rad or m; profiles may round what the URDF gives with many places."""
_MOVES = ("revolute", "continuous", "prismatic")


def check(model: Model, urdf: Urdf, root: ElementTree.Element) -> None:
    """Check ``model`` against its URDF.

    Raises:
        AtKey: with the key that is wrong.
    """
    _links(model, urdf)
    if model.base is None:
        _chain(model, urdf)
        for number, joint in enumerate(model.joints):
            _limits(model, number, urdf.joints[joint.name])
        _stands_at_root(model, urdf, root)
    else:
        _wheels(model, urdf)
    _fingers(model, urdf)
    _cameras(model, urdf)
    for number, pair in enumerate(model.never_touch):
        for link in pair:
            _known_link(link, urdf, "never_touch", number)


def _links(model: Model, urdf: Urdf) -> None:
    _known_link(model.base_link, urdf, "base_link")
    _known_link(model.tool_link, urdf, "tool_link")
    try:
        first = urdf.root
    except ValueError as error:
        raise AtKey(f"the URDF {model.urdf} is not one tree: {error}", "urdf") from error
    if model.base_link != first and model.base is not None:
        raise AtKey(f"base_link: of a robot that drives it is the first link, {first}", "base_link")
    try:
        urdf.chain(model.base_link, model.tool_link)
    except ValueError as error:
        raise AtKey(f"tool_link: {error}", "tool_link") from error


def _chain(model: Model, urdf: Urdf) -> None:
    """The profile's joints are all that move between base and tool, in this order."""
    for number, joint in enumerate(model.joints):
        if joint.name not in urdf.joints:
            raise AtKey(
                f"there is no joint {joint.name!r} in the URDF; it has: {_some(urdf.joints)}",
                "joints",
                number,
                "name",
            )
        kind = urdf.joints[joint.name].kind
        if kind not in _MOVES:
            raise AtKey(
                f"the joint {joint.name} is {kind} in the URDF; it has to be one of: "
                f"{', '.join(_MOVES)}",
                "joints",
                number,
                "name",
            )
    moving = [
        joint.name
        for joint in urdf.chain(model.base_link, model.tool_link)
        if joint.kind != "fixed"
    ]
    given = [joint.name for joint in model.joints]
    if moving != given:
        number = next(
            (place for place, name in enumerate(given) if moving[place : place + 1] != [name]), 0
        )
        raise AtKey(
            f"between {model.base_link} and {model.tool_link} move, in this order: "
            f"{', '.join(moving) or 'no joints'}; the joints given are: {', '.join(given)}",
            "joints",
            number,
        )


def _limits(model: Model, number: int, there: UrdfJoint) -> None:
    joint = model.joints[number]
    for key, given, bound, over in (
        ("lower", joint.lower, there.lower, joint.lower < there.lower - _ROUNDING),
        ("upper", joint.upper, there.upper, joint.upper > there.upper + _ROUNDING),
        (
            "velocity",
            joint.velocity,
            there.velocity,
            joint.velocity > there.velocity * (1 + _ROUNDING),
        ),
    ):
        if over:
            raise AtKey(
                f"{joint.name}: {key} {given} is beyond the URDF's {bound}", "joints", number, key
            )


def _stands_at_root(model: Model, urdf: Urdf, root: ElementTree.Element) -> None:
    """Everything is given in the base link's frame, which is then the world's."""
    for joint in urdf.chain(urdf.root, model.base_link):
        element = next(one for one in root.findall("joint") if one.get("name") == joint.name)
        origin = element.find("origin")
        numbers = [] if origin is None else f"{origin.get('xyz')} {origin.get('rpy')}".split()
        if joint.kind != "fixed" or any(word not in ("None",) and float(word) for word in numbers):
            raise AtKey(
                f"base_link: {model.base_link} stands away from the URDF's first link "
                f"{urdf.root}; give {urdf.root}",
                "base_link",
            )


def _wheels(model: Model, urdf: Urdf) -> None:
    assert model.base is not None
    for side in ("left", "right"):
        for name in getattr(model.base, side):
            if name not in urdf.joints:
                raise AtKey(
                    f"base.{side}: there is no joint {name!r} in the URDF; it has: "
                    f"{_some(urdf.joints)}",
                    "base",
                    side,
                )
            if urdf.joints[name].kind not in ("continuous", "revolute"):
                raise AtKey(f"base.{side}: the joint {name} does not turn", "base", side)


def _fingers(model: Model, urdf: Urdf) -> None:
    if model.gripper is None:
        return
    for name in model.gripper.fingers:
        where = ("gripper", "fingers")
        if name not in urdf.joints:
            raise AtKey(
                f"gripper.fingers: there is no joint {name!r} in the URDF; it has: "
                f"{_some(urdf.joints)}",
                *where,
            )
        joint = urdf.joints[name]
        if joint.kind != "prismatic":
            raise AtKey(f"gripper.fingers: {name} is {joint.kind}, and has to slide", *where)
        if model.gripper.width / 2 > joint.upper + _ROUNDING:
            raise AtKey(
                f"gripper.width: {model.gripper.width} m needs {model.gripper.width / 2} m of each "
                f"finger, and {name} slides to {joint.upper} m",
                "gripper",
                "width",
            )


def _cameras(model: Model, urdf: Urdf) -> None:
    for number, camera in enumerate(model.cameras):
        if camera.link != ROOM:
            _known_link(camera.link, urdf, "cameras", number, "link")
        for link in camera.shows:
            _known_link(link, urdf, "cameras", number, "shows")


def _known_link(link: str, urdf: Urdf, *path: str | int) -> None:
    if link not in urdf.links:
        raise AtKey(f"there is no link {link!r} in the URDF; it has: {_some(urdf.links)}", *path)


def _some(names: object) -> str:
    known = sorted(names)  # type: ignore[call-overload]
    return ", ".join(known[:12]) + (", ..." if len(known) > 12 else "")
