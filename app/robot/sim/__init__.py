"""A robot in PyBullet: physics for the node, pictures for the camera process."""

import contextlib
import os


def _import_pybullet_quietly() -> None:
    """Import PyBullet without the line about its build that it writes to standard error."""
    saved = os.dup(2)
    try:
        with open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(saved, 2)
        os.close(saved)


with contextlib.suppress(OSError):  # no standard error: nothing to keep quiet
    _import_pybullet_quietly()
