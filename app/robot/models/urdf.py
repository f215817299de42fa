"""What a URDF says, as far as a profile is checked against it. Nothing here needs PyBullet."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

_OPTENV = re.compile(r"\$\(optenv\s+\w+\s*([^)]*)\)")
_CHAIN_TOO_LONG = 1000


class UrdfJoint(NamedTuple):
    """One joint of a URDF."""

    name: str
    kind: str
    """revolute, continuous, prismatic, fixed, ..."""
    parent: str
    child: str
    lower: float
    """rad or m; -inf without limits"""
    upper: float
    velocity: float
    """rad/s or m/s; inf where the file gives none or 0"""
    mimics: bool


class Urdf(NamedTuple):
    """The links and joints of a URDF."""

    links: frozenset[str]
    joints: dict[str, UrdfJoint]

    @property
    def root(self) -> str:
        """The link that is nobody's child.

        Raises:
            ValueError: there is not exactly one.
        """
        roots = sorted(self.links - {joint.child for joint in self.joints.values()})
        if len(roots) != 1:
            raise ValueError(f"it has {len(roots)} links that hang on no joint: {roots[:5]}")
        return roots[0]

    def chain(self, base: str, tool: str) -> list[UrdfJoint]:
        """The joints from the link ``base`` to the link ``tool``, in this order.

        Raises:
            ValueError: there are none.
        """
        above = {joint.child: joint for joint in self.joints.values()}
        chain: list[UrdfJoint] = []
        link = tool
        while link != base:
            if link not in above or len(chain) > _CHAIN_TOO_LONG:
                raise ValueError(f"no joints lead from the link {base} to the link {tool}")
            chain.append(above[link])
            link = above[link].parent
        return chain[::-1]


def read_urdf(path: Path) -> ElementTree.Element:
    """The ``<robot>`` element of a URDF, with ``$(optenv NAME VALUE)`` replaced by its value.

    Raises:
        ValueError: the file cannot be read, is not XML, or is no URDF; with its line.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise ValueError(f"the URDF {path} cannot be read: {reason}") from error
    try:
        root = ElementTree.fromstring(_OPTENV.sub(r"\1", text))
    except ElementTree.ParseError as error:
        raise ValueError(f"the URDF {path} is not XML: {error}") from error
    if root.tag != "robot":
        raise ValueError(f"the URDF {path} begins with <{root.tag}>, not with <robot>")
    if "$(" in text.replace("$(optenv", "") or "${" in text:
        line = next(
            number
            for number, line in enumerate(text.splitlines(), start=1)
            if "${" in line or "$(" in line.replace("$(optenv", "")
        )
        raise ValueError(
            f"the URDF {path} is still a xacro file (line {line}); run xacro on it first"
        )
    return root


def parse_urdf(root: ElementTree.Element, name: str) -> Urdf:
    """The links and joints of a ``<robot>`` element.

    Raises:
        ValueError: a joint is not complete, or a name comes twice.
    """
    links = [_name(link, "link", name) for link in root.findall("link")]
    joints: dict[str, UrdfJoint] = {}
    for element in root.findall("joint"):
        joint = _joint(element, name)
        if joint.name in joints:
            raise ValueError(f"the URDF {name} has two joints {joint.name}")
        for link in (joint.parent, joint.child):
            if link not in links:
                raise ValueError(
                    f"the URDF {name}: joint {joint.name} speaks of a link {link!r} that is not "
                    "there"
                )
        joints[joint.name] = joint
    twice = [link for link in links if links.count(link) > 1]
    if twice:
        raise ValueError(f"the URDF {name} has two links {twice[0]}")
    if not links:
        raise ValueError(f"the URDF {name} has no links")
    return Urdf(frozenset(links), joints)


def mesh_line(path: Path, name: str) -> int:
    """The line of a URDF that first names a mesh; 1 when none does."""
    text = path.read_text("utf-8", "replace")
    return text.count("\n", 0, max(0, text.find(f'"{name}"'))) + 1


def _name(element: ElementTree.Element, kind: str, urdf: str) -> str:
    name = element.get("name")
    if not name:
        raise ValueError(f"the URDF {urdf} has a {kind} without a name")
    return name


def _joint(element: ElementTree.Element, urdf: str) -> UrdfJoint:
    name = _name(element, "joint", urdf)
    kind = element.get("type", "")
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = (None if end is None else end.get("link") for end in ends)
    if not kind or not parent or not child:
        raise ValueError(f"the URDF {urdf}: joint {name} needs a type, a parent and a child")
    limit = element.find("limit")

    def number(key: str, otherwise: float) -> float:
        return _number(limit, key, otherwise, lambda: f"the URDF {urdf}: joint {name}")

    bounded = limit is not None and kind != "continuous"
    return UrdfJoint(
        name,
        kind,
        parent,
        child,
        number("lower", 0.0) if bounded else -math.inf,
        number("upper", 0.0) if bounded else math.inf,
        number("velocity", 0.0) or math.inf,
        element.find("mimic") is not None,
    )


def _number(
    element: ElementTree.Element | None, key: str, otherwise: float, where: Callable[[], str]
) -> float:
    text = None if element is None else element.get(key)
    if text is None:
        return otherwise
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{where()}: {key} is {text!r}, not a number") from None
