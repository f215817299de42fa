"""The synthetic operator's video: drawn once by a process of its own, then kept."""

import asyncio
import contextlib
import hashlib
import logging
import os
import sys
import tempfile
from pathlib import Path

from app import gestures
from app.errors import WorldError
from app.gateway.node_process import node_environment

log = logging.getLogger(__name__)

DRAW_S = 300.0
_DRAW = (
    "import os, sys; from pathlib import Path; os.nice(5); "
    "from app.gestures.synthetic import operator_clip; operator_clip(Path(sys.argv[1]))"
)


class NoClip(WorldError):
    """The video could not be drawn."""

    default_code = "no_clip"


class Clip:
    """Draws the video when it is first asked for, and keeps it under the hash of what drew it.

    Drawing takes seconds of a whole core: in a process of its own, at low priority, it disturbs
    neither frames nor the robot. Used on the event loop only.

    Args:
        folder: Where to keep it.
    """

    def __init__(self, folder: Path) -> None:
        digest = hashlib.sha256()
        for source in sorted(Path(gestures.__file__).parent.rglob("*.py")):
            digest.update(source.read_bytes())
        self._path = folder / f"operator-{digest.hexdigest()[:16]}.webm"
        self._lock = asyncio.Lock()

    async def path(self) -> Path:
        """The video's file.

        Raises:
            NoClip: it could not be drawn.
        """
        async with self._lock:
            if not self._path.is_file():
                await self._draw()
        return self._path

    async def _draw(self) -> None:
        """Draw beside the path and move it there whole."""
        draft: Path | None = None
        process: asyncio.subprocess.Process | None = None
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self._path.parent, prefix=".clip-", suffix=".webm")
            os.close(handle)
            draft = Path(name)
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-c", _DRAW, name,
                stdin=asyncio.subprocess.DEVNULL, stdout=2, env=node_environment(),
            )  # fmt: skip
            async with asyncio.timeout(DRAW_S):
                code = await process.wait()
            if code != 0:
                raise NoClip(f"the video could not be drawn (exit code {code}); see the log")
            draft.replace(self._path)
        except (OSError, TimeoutError) as error:
            raise NoClip(f"the video could not be drawn: {error or 'it took too long'}") from error
        finally:
            if process is not None and process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
            if draft is not None:
                draft.unlink(missing_ok=True)
