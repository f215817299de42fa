"""A process for heavy work: one piece at a time, behind everything else on the machine.

What it works on was sent by others, and may be made to take for ever, to take all memory, or to
crash a decoder. So it is bounded here by the kernel, and its parent
(:mod:`app.gateway.work_pool`) may end it at any moment.
"""

import math
import resource
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path

from app.errors import FarhandError
from app.gateway.work_messages import Piece, Told
from app.robot.beside import give_way


def run(connection: Connection) -> None:
    """Do what is asked for, until the other end is closed."""
    while True:
        try:
            piece: Piece = connection.recv()
        except (EOFError, OSError):
            return
        told = _do(piece, connection)
        try:
            connection.send(told)
        except (EOFError, OSError):
            return
        except Exception:  # what came of it, or its error, cannot be sent
            connection.send(Told("broken", traceback.format_exc()))


def _do(piece: Piece, connection: Connection) -> Told:
    last = -1

    def progress(done: int, total: int) -> None:
        nonlocal last
        percent = 100 * done // max(total, 1)
        if percent != last:  # telling takes longer than many a step
            last = percent
            connection.send(Told("progress", (done, total)))

    keywords = {"progress": progress} if piece.tells else {}
    try:
        with _limited(piece):
            return Told("done", piece.function(*piece.arguments, **keywords))
    except FarhandError as error:
        return Told("refused", error)
    except MemoryError:
        return Told("memory", None)
    except Exception:
        return Told("broken", traceback.format_exc())


@contextmanager
def _limited(piece: Piece) -> Iterator[None]:
    """Meanwhile the kernel refuses more memory, and ends the process after its processor time."""
    here = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    used = time.process_time()
    with (
        _soft(resource.RLIMIT_AS, here + piece.memory),
        _soft(resource.RLIMIT_CPU, math.ceil(used + piece.cpu_s)),
    ):
        yield


@contextmanager
def _soft(limit: int, value: int) -> Iterator[None]:
    before, hard = resource.getrlimit(limit)
    lowest = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(limit, (lowest, hard))
    try:
        yield
    finally:
        resource.setrlimit(limit, (before, hard))


def main() -> None:
    """``python -m app.gateway.work_process FD NICENESS``; the parent has the pair's other end."""
    give_way(int(sys.argv[2]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    run(Connection(int(sys.argv[1])))


if __name__ == "__main__":
    main()
