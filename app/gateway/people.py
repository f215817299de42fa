"""Who is there, who drives, and who asks to.

To take over stops the arm and surprises whoever drives. So one may ask: the driver's page shows it,
and the driver hands control over, or goes on.
"""

from typing import TYPE_CHECKING, Any

from app.errors import FarhandError, NoControl, RequestError
from app.gateway.numbers import tick_ms

if TYPE_CHECKING:
    from app.gateway.robot_port import RobotPort
    from app.gateway.session import OperatorSession


class NobodyAsks(RequestError):
    """Control was to be handed to a session that does not ask for it."""

    default_code = "nobody_asks"
    status = 409


class People:
    """The sessions of one server. Used on the event loop.

    Args:
        robot: Whose driver is meant.
        most_operators: Sessions of operators at once.
        most_observers: The same of observers.
    """

    def __init__(self, robot: "RobotPort", most_operators: int, most_observers: int) -> None:
        self.sessions: set[OperatorSession] = set()
        self._robot = robot
        self._most = {"operator": most_operators, "observer": most_observers}
        self._asking: dict[str, None] = {}
        """Names of sessions, in the order in which they asked."""

    def why_full(self, role: str) -> str | None:
        """Why no further session of this role is let in; None when one is."""
        most = self._most[role]
        if self._count(role) < most:
            return None
        here = f"{most} {role}s are" if most != 1 else f"1 {role} is"
        return f"{here} here already, and no more are let in"

    def add(self, session: "OperatorSession") -> None:
        """Somebody came."""
        self.sessions.add(session)
        self.tell()

    def discard(self, session: "OperatorSession") -> None:
        """Somebody went."""
        self.sessions.discard(session)
        self._asking.pop(session.name, None)
        self.tell()

    def ask(self, session: "OperatorSession") -> None:
        """Ask the one who drives for control.

        Raises:
            NoControl: nobody drives, or this session does: there is nobody to ask.
        """
        driver = self._driver
        if driver is None:
            raise NoControl("nobody drives: take control")
        if driver == session.name:
            raise NoControl("you drive already")
        self._asking[session.name] = None
        self.tell()

    def keep(self, session: "OperatorSession") -> None:
        """Go on driving: whoever asks is told so.

        Raises:
            NoControl: this session does not drive.
        """
        if self._driver != session.name:
            raise NoControl("you do not have control", controller=self._driver)
        refused, self._asking = self._asking, {}
        for other in self.sessions:
            if other.name in refused:
                other.tell(NoControl(f"{session.name} goes on driving", code="control_kept"))
        self.tell()

    async def hand_over(self, session: "OperatorSession", to: str) -> None:
        """Give control to a session that asked for it; the robot is disarmed by that.

        Raises:
            NobodyAsks: ``to`` does not ask, or is gone. Nothing is changed.
            NoControl: ``session`` does not drive.
            RobotUnavailable: the robot does not answer.
        """
        next_one = next((other for other in self.sessions if other.name == to), None)
        if next_one is None or to not in self._asking:
            raise NobodyAsks(f"{to} does not ask for control any more")
        await session.give_up()
        self._asking = {}
        try:
            await next_one.take()
        except FarhandError as error:
            # It has left meanwhile, or another was quicker; nobody drives by mistake.
            next_one.tell(error)
        self.tell()

    def saw_driver(self) -> None:
        """Look who drives now: who has got control, or could take it, asks no more."""
        driver = self._driver
        still = {} if driver is None else {n: None for n in self._asking if n != driver}
        if still != self._asking:
            self._asking = still
            self.tell()

    def tell(self) -> None:
        """Send the ``people`` message to everyone."""
        message = self.message()
        for session in self.sessions:
            session.outbox.put(message)

    def message(self) -> dict[str, Any]:
        """The ``people`` message."""
        return {
            "type": "people",
            "tick": tick_ms(),
            "operators": self._count("operator"),
            "observers": self._count("observer"),
            "asking": list(self._asking),
        }

    @property
    def _driver(self) -> str | None:
        state = self._robot.live_state
        return None if state is None else state.controller

    def _count(self, role: str) -> int:
        return sum(session.role == role for session in self.sessions)
