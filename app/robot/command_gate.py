"""Lets through only commands that count: of this lease, newer than the last, and fresh."""

from collections import Counter

from app.link.messages import Command


class CommandGate:
    """Refuses old, repeated, foreign and impossible commands, and counts them by reason.

    Age is judged by the node's own clock alone: a command carries the newest tick of the node that
    its sender had seen.
    """

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        """By reason: ``no_lease``, ``epoch``, ``sequence``, ``expired``, ``future``."""
        self._epoch = -1
        self._sequence = -1

    def admit(self, command: Command, epoch: int | None, tick: int) -> bool:
        """Whether ``command`` counts, at ``tick`` (ms) and under the lease ``epoch``, if any."""
        reason = self._fault(command, epoch, tick)
        if reason is not None:
            self.dropped[reason] += 1
            return False
        self._epoch, self._sequence = command.epoch, command.sequence
        return True

    def _fault(self, command: Command, epoch: int | None, tick: int) -> str | None:
        if epoch is None:
            return "no_lease"
        if command.epoch != epoch:
            return "epoch"
        if command.epoch == self._epoch and command.sequence <= self._sequence:
            return "sequence"
        if command.tick > tick:
            return "future"
        if tick - command.tick > command.ttl_ms:
            return "expired"
        return None
