"""What was changed can be taken back: the id to do so with goes out with the answer."""

from starlette.responses import Response

from app.gestures import GestureStore
from app.gestures.rows import new_id

HEADER = "Farhand-Change"
"""Of answers to what changed gestures; see docs/protocol.md."""


class UndoOffer:
    """For one request that changes gestures.

    Args:
        store: Where it changes them.
    """

    def __init__(self, store: GestureStore) -> None:
        self._store = store
        self.id = new_id()
        """Goes into the store's method as ``undo_as``."""

    @property
    def made(self) -> str | None:
        """The id, once there is something to take back."""
        return self.id if self._store.history.knows(self.id) else None

    def to(self, response: Response) -> None:
        """Say so in the answer's head."""
        if self.made is not None:
            response.headers[HEADER] = self.id
