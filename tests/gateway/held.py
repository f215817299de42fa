"""Work for a process of a pool that goes on for as long as a test wants it to."""

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from app.config import PipelineSettings
from app.errors import Invalid
from app.gestures import NewGesture, setfile
from app.pipeline import PcaMatcher, burst, mix_ups


def wait() -> None:
    """Until the file that ``HELD_WHILE`` names is gone."""
    while Path(os.environ["HELD_WHILE"]).exists():
        time.sleep(0.01)


def try_all(
    matcher: PcaMatcher, labels: Sequence[str], progress: Callable[[int, int], None]
) -> mix_ups.MixUps:
    """As that of the product, once it may."""
    progress(0, 100)
    wait()
    return mix_ups.try_all(matcher, labels)


def look_at(image: bytes, settings: PipelineSettings) -> burst.Look:
    """As that of the product, once it may."""
    wait()
    return burst.look_at(image, settings)


def read_zip(data: bytes, progress: Callable[[int, int], None] | None = None) -> list[NewGesture]:
    """As that of the product, once it may; it says nothing meanwhile."""
    wait()
    return setfile.read_zip(data, progress)


def take_for(data: bytes, progress: Callable[[int, int], None] | None = None) -> int:
    """As a file that takes 200 MiB to read."""
    return take(200)


def take(mib: int) -> int:
    """Memory."""
    return len(b"x" * (mib << 20))


def burn() -> None:
    """Processor time, without end."""
    while True:
        pass


def refuse(value: int) -> None:
    """As the product refuses."""
    raise Invalid(f"not {value}", field="value", value=value)


def fail() -> None:
    """As what nobody foresaw."""
    raise KeyError("secret")


def crash() -> None:
    """As a decoder that is broken."""
    os.abort()


def tell(total: int, progress: Callable[[int, int], None]) -> str:
    """How far it is."""
    for done in range(total + 1):
        progress(done, total)
    return "told"
