"""Rest: one answer to whether the hand rests, from its mask's motion or from its landmarks'."""

from typing import NamedTuple, Self

from app.pipeline.hand_landmarks.stillness import Rest
from app.pipeline.motion import Motion


class AtRest(NamedTuple):
    """What the order of the stages asks.

    Attributes:
        waits: Too few frames were seen to say.
        still: The hand may be matched.
        nearly_still: It may go on holding a gesture.
        settled: A gesture may start.
        why_moving: In plain words.
    """

    waits: bool
    still: bool
    nearly_still: bool
    settled: bool
    why_moving: str

    @classmethod
    def of_mask(cls, motion: Motion) -> Self:
        """By the part of the picture that changed (paper)."""
        why = f"hand still moving: {motion.fraction or 0:.1%} of the pixels changed"
        still = motion.still or motion.trembling
        return cls(motion.fraction is None, still, motion.nearly_still, motion.settled, why)

    @classmethod
    def of_hand(cls, rest: Rest) -> Self:
        """By the landmarks."""
        why = f"hand still moving: {rest.speed or 0:.1f} palm lengths a second"
        return cls(rest.speed is None, rest.still, rest.nearly_still, rest.settled, why)
