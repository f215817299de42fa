"""The robot node's end of the link: what the control loop reads and says, without waiting.

Everything that arrives is kept by Zenoh's own threads in short rings that hold the newest
messages; nothing of this class runs outside the caller's thread. So a flood of messages costs the
control loop at most one ring's worth of decoding in a cycle, and never a queue.
"""

import logging
import os
import stat
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import zenoh

from app.errors import LinkFailed
from app.link.messages import (
    Command,
    Description,
    LeaseReply,
    LeaseRequest,
    Message,
    State,
    StopRequest,
    key,
)
from app.link.reading import decode
from app.link.session import open_session

log = logging.getLogger(__name__)

_RING = 32
"""Messages of a kind kept between two cycles of the control loop; the newest stay."""

Reply = Callable[[LeaseReply], None]
_M = TypeVar("_M", bound=Message)


def private_folder(endpoint: str) -> Path | None:
    """Make the folder of a unix socket, readable by its owner alone (0700).

    Returns:
        The folder, or None when the endpoint is not a unix socket.

    Raises:
        LinkFailed: the folder cannot be made, belongs to somebody else, or is open to others:
            whoever reaches the socket can move the arm.
    """
    kind, _, path = endpoint.partition("/")
    if kind != "unixsock-stream":
        return None
    folder = Path(path).parent
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as error:
        raise LinkFailed(
            f"the folder {folder} of the link's socket cannot be made: {error.strerror}",
            folder=str(folder),
        ) from error
    mode = stat.S_IMODE(found.st_mode)
    if found.st_uid != os.geteuid():
        raise LinkFailed(
            f"the folder {folder} of the link's socket belongs to user {found.st_uid}; "
            "choose a folder of your own",
            folder=str(folder),
        )
    if mode & 0o077:
        raise LinkFailed(
            f"the folder {folder} of the link's socket is open to others (mode {mode:04o}); "
            f"make it private with: chmod 700 {folder}",
            folder=str(folder),
        )
    return folder


class NodeEnd:
    """Listens for commands, stops and questions; publishes states.

    Args:
        robot: The robot's id, part of every key.
        endpoint: Zenoh endpoint to listen on, such as ``unixsock-stream/PATH``.

    Raises:
        LinkFailed: the endpoint cannot be opened, or its folder is not private.
    """

    def __init__(self, robot: str, endpoint: str) -> None:
        private_folder(endpoint)
        self.invalid: Counter[str] = Counter()
        """Messages that could not be read, by kind."""
        self._session = open_session(endpoint, listen=True)
        ring = zenoh.handlers.RingChannel
        self._stops = self._session.declare_subscriber(key(robot, "stop"), ring(_RING))
        self._commands = self._session.declare_subscriber(key(robot, "command"), ring(_RING))
        self._leases = self._session.declare_queryable(key(robot, "lease"), ring(_RING))
        self._descriptions = self._session.declare_queryable(key(robot, "description"), ring(_RING))
        self._state = self._session.declare_publisher(
            key(robot, "state"),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            express=True,
        )
        self._lease_key = key(robot, "lease")
        self._description_key = key(robot, "description")
        # Last, so that whoever sees the token can already be answered.
        self._alive = self._session.liveliness().declare_token(key(robot, "alive"))

    def commands(self) -> list[Command]:
        """The commands that arrived since the last call, oldest first, at most 32.

        More than the newest one, so that a flood from somebody without the lease cannot push the
        holder's command out of sight.
        """
        found = []
        for _ in range(_RING):
            if (sample := self._commands.try_recv()) is None:
                break
            if (command := self._decode(Command, sample.payload)) is not None:
                found.append(command)
        return found

    def stop_requests(self) -> list[StopRequest]:
        """The stop requests that arrived since the last call, oldest first.

        A request on the stop key that cannot be read still stops: as S1, from "unreadable".
        """
        found = []
        for _ in range(_RING):
            if (sample := self._stops.try_recv()) is None:
                break
            found.append(
                self._decode(StopRequest, sample.payload)
                or StopRequest(source="unreadable", reason="a stop request that cannot be read")
            )
        return found

    def lease_requests(self) -> list[tuple[LeaseRequest, Reply]]:
        """The lease requests that wait for an answer, each with the way to answer it."""
        found: list[tuple[LeaseRequest, Reply]] = []
        for _ in range(_RING):
            if (query := self._leases.try_recv()) is None:
                break
            request = self._decode(LeaseRequest, query.payload)
            if request is None:
                refusal = LeaseReply(
                    granted=False, code="invalid", reason="the request cannot be read"
                )
                self._answer(query, self._lease_key, refusal)
            else:
                found.append((request, self._answerer(query)))
        return found

    def answer_descriptions(self, description: Description) -> None:
        """Answer whoever asks what this robot is."""
        for _ in range(_RING):
            if (query := self._descriptions.try_recv()) is None:
                break
            self._answer(query, self._description_key, description)

    def publish_state(self, state: State) -> None:
        """Say what the robot is and does; drops the message rather than wait."""
        try:
            self._state.put(state.encode())
        except zenoh.ZError as error:
            self.invalid["state_unsent"] += 1
            log.debug("state not sent: %s", error)

    def close(self) -> None:
        """Leave the link."""
        self._session.close()  # type: ignore[no-untyped-call]

    def _decode(self, kind: type[_M], payload: zenoh.ZBytes | None) -> _M | None:
        message = decode(kind, b"" if payload is None else payload.to_bytes())
        if message is None:
            self.invalid[kind.__name__.lower()] += 1
        return message

    def _answerer(self, query: zenoh.Query) -> Reply:
        return lambda reply: self._answer(query, self._lease_key, reply)

    def _answer(self, query: zenoh.Query, on: str, message: Message) -> None:
        try:
            query.reply(on, message.encode(), express=True)
        except zenoh.ZError as error:
            self.invalid["reply_unsent"] += 1
            log.debug("answer on %s not sent: %s", on, error)
        query.drop()  # type: ignore[no-untyped-call]
