"""Real contact of the arm with things around it: when is it a collision?"""

from collections.abc import Callable

from app.robot.arm import Contact


class ContactWatch:
    """Judges what the arm feels, once a cycle.

    A link that presses on a thing with more than the threshold has collided with it. A grasp is
    none: a finger on a thing that can be grasped may press with the gripper's own force on top.
    And where the arm already leans on something when the brakes come off, it may lean so hard, and
    harder by the threshold, until it has come away: the way out stays open after a collision.

    Args:
        threshold: N.
        grasp: N; the gripper's own force of one finger.
    """

    def __init__(self, threshold: float, grasp: float) -> None:
        self._threshold = threshold
        self._grasp = grasp
        self._leaning: dict[tuple[str, str], float] = {}

    def released(self, contacts: tuple[Contact, ...]) -> None:
        """The brakes come off: what the arm leans on now is known."""
        self._leaning = {(c.link, c.thing): c.force for c in contacts}

    def collision(self, contacts: tuple[Contact, ...], plain: Callable[[str], str]) -> str | None:
        """The worst collision among ``contacts`` in plain words, if there is one.

        Args:
            contacts: As felt in this cycle.
            plain: Puts names of links and things into plain words.
        """
        felt = {(c.link, c.thing): c for c in contacts}
        self._leaning = {
            pair: min(force, felt[pair].force)
            for pair, force in self._leaning.items()
            if pair in felt
        }
        worst, most = None, 0.0
        for pair, contact in felt.items():
            allowed = self._threshold + self._leaning.get(pair, 0.0)
            if contact.grasp:
                allowed += self._grasp
            if contact.force - allowed > most:
                worst, most = contact, contact.force - allowed
        if worst is None:
            return None
        link, thing = plain(worst.link), plain(worst.thing)
        return f"the {link} touched the {thing} with {worst.force:.0f} N"
