"""The gallery that one session is recognised against."""

from collections.abc import Awaitable, Callable

from app.errors import NotFound
from app.gateway.gallery import Enrolled, LiveGallery
from app.gestures.records import SHARED

Learn = Callable[[Callable[[str], Enrolled], str], Awaitable[Enrolled]]


class GalleryChoice:
    """The shared gallery, until another is chosen. Used on the event loop.

    Args:
        live: All galleries.
        learn: Calls, on a thread, a function that gives a gallery by its id.
    """

    def __init__(self, live: LiveGallery, learn: Learn) -> None:
        self._live = live
        self._learn = learn
        self.id = SHARED
        """Id of the gallery."""
        live.join(SHARED)

    @property
    def enrolled(self) -> Enrolled:
        """What the gallery holds; the shared one's, from the moment at which it is deleted."""
        return self._live.known(self.id) or self._live.current

    async def choose(self, id: str) -> None:
        """Use another gallery from the next frame on. Its matcher may have to be fitted first.

        Raises:
            NotFound: no gallery has this id; nothing changes then.
        """
        self._live.join(id)
        try:
            await self._learn(self._live.of, id)
            if self._live.known(id) is None:
                raise NotFound("the gallery has just been deleted", id=id)
        except BaseException:
            self._live.leave(id)
            raise
        self.close()
        self.id = id

    def check(self) -> None:
        """Fall back to the shared gallery if this one was deleted."""
        if self._live.known(self.id) is None:
            self.close()
            self.id = SHARED
            self._live.join(SHARED)

    def close(self) -> None:
        """Use no gallery any more."""
        self._live.leave(self.id)
