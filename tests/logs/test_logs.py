"""Programs whose output is read late, never, or as ever."""

import io
import logging
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app import logs
from app.logs import FLUSH_S
from app.logs.writer import LONGEST, WAITING
from tests.unread import PipeReader, Reader, TerminalReader

ROOT = Path(__file__).parents[2]
BEGIN = """
import ctypes, logging, os, subprocess, sys, threading, time, traceback, warnings
from app import logs
log = logging.getLogger("x")
libc = ctypes.CDLL(None)
"""
EVERY_WAY = """
def every_way(number):
    log.info("record %d", number)
    print("printed", number, file=sys.stderr)
    libc.write(2, b"by C\\n", 5)
    libc.write(1, b"by C\\n", 5)
    warnings.warn(f"warning {number}")
    alone = logging.getLogger("alone")  # as a library that has no handler and does not propagate
    alone.propagate = False
    alone.warning("alone %d", number)
    log.info("%d", "no number")
    try:
        raise ValueError(f"error {number}")
    except ValueError:
        log.exception("failed")
    thread = threading.Thread(target=lambda: 1 / 0)
    thread.start()
    thread.join()
"""


@pytest.fixture(params=[PipeReader, TerminalReader])
def reader(request: pytest.FixtureRequest) -> Iterator[Reader]:
    with request.param() as reader:
        yield reader


@contextmanager
def program(reader: Reader, text: str, *, begin: str = BEGIN) -> Iterator[subprocess.Popen[str]]:
    """A program whose standard error is read by ``reader``; tells how far it is on a pipe."""
    done, telling = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-c", begin + text, str(telling)],
        stdin=subprocess.PIPE,
        stdout=reader.handle,
        stderr=reader.handle,
        pass_fds=[telling],
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "always"},
    )
    os.close(telling)
    process.told = os.fdopen(done)  # type: ignore[attr-defined]
    try:
        yield process
    finally:
        process.kill()
        process.communicate()
        process.told.close()  # type: ignore[attr-defined]


def told(process: subprocess.Popen[str]) -> str:
    line: str = process.told.readline()  # type: ignore[attr-defined]
    return line.strip()


def run(reader: Reader, text: str) -> None:
    with program(reader, text) as process:
        assert process.wait(60) == 0


def test_nobody_waits_for_who_does_not_read(reader: Reader) -> None:
    text = (
        EVERY_WAY
        + """
with logs.written_apart():
    sys.stdin.readline()
    for number in range(1000):
        every_way(number)
    os.write(int(sys.argv[1]), f"{logs.dropped()}\\n".encode())
    sys.stdin.readline()
    log.info("the last line")
    sys.exit(3)
"""
    )
    with program(reader, text) as process:
        reader.stop()
        print(file=process.stdin, flush=True)
        dropped = int(told(process))
        assert dropped > 0
        started = time.monotonic()
        print(file=process.stdin, flush=True)
        assert process.wait(60) == 3  # neither its end nor what it ends with waits
        assert time.monotonic() - started < 10 * FLUSH_S


def test_what_was_dropped_is_told_where_it_is_missing_and_the_rest_comes() -> None:
    text = """
with logs.written_apart("%(message)s"):
    sys.stdin.readline()
    for number in range(5000):
        log.info("line %d", number)
    os.write(int(sys.argv[1]), b"written\\n")
    sys.stdin.readline()
    log.info("line 5000")
"""
    with PipeReader() as reader, program(reader, text) as process:
        reader.stop()
        print(file=process.stdin, flush=True)
        assert told(process) == "written"
        reader.go_on()
        while "dropped" not in reader.text:
            time.sleep(0.01)
        print(file=process.stdin, flush=True)
        assert process.wait(60) == 0
        reader.finish()
    lines = [line for line in reader.text.splitlines() if line]
    numbers = [int(line.split()[1]) for line in lines if line.startswith("line ")]
    assert numbers == [*range(len(numbers) - 1), 5000]
    assert WAITING <= len(numbers) < 5000
    told_of = [re.match(r"(\d+) lines for standard error were dropped", line) for line in lines]
    counts = [int(found[1]) for found in told_of if found is not None]
    assert sum(counts) + len(numbers) == 5001


def test_read_as_ever_all_comes_and_before_the_end(reader: Reader) -> None:
    run(
        reader,
        EVERY_WAY + "with logs.written_apart():\n    every_way(7)\n    print('begun', end='')\n",
    )
    reader.finish()
    for line in (
        r"INFO record 7\n",
        r"printed 7\n",
        r"by C\n(.*\n)?by C\n",
        r"UserWarning: warning 7\n",
        r"WARNING alone 7\n",
        r"a line of x cannot be put together: TypeError\n",
        r"ERROR failed\n  Traceback \(most recent call last\):\n.*\n  ValueError: error 7\n",
        r"ZeroDivisionError: division by zero\n",
        r"begun$",
    ):
        assert re.search(line, reader.text, re.DOTALL), (line, reader.text)


def test_a_line_says_what_was_so_when_it_was_logged() -> None:
    text = """
class Failing(Exception):
    def __str__(self):
        return f"{things}"
with logs.written_apart("%(message)s"):
    sys.stdin.readline()
    things = ["before"]
    log.info("there is %s", things)
    try:
        try:
            raise OSError(5, "the cause")
        except OSError as error:
            raise Failing from error
    except Failing:
        log.exception("it failed")
    things[:] = ["after"]
    os.write(int(sys.argv[1]), b"logged\\n")
    sys.stdin.readline()
"""
    with PipeReader() as reader, program(reader, text) as process:
        reader.stop()
        print(file=process.stdin, flush=True)
        assert told(process) == "logged"
        reader.go_on()
        print(file=process.stdin, flush=True)
        assert process.wait(60) == 0
        reader.finish()
    assert "there is ['before']" in reader.text
    assert "OSError: [Errno 5] the cause" in reader.text
    assert "direct cause of the following" in reader.text
    assert "Failing: ['before']" in reader.text
    assert "after" not in reader.text


def test_programs_that_are_started_write_where_this_one_was_to() -> None:
    text = """
with logs.written_apart():
    child = "import sys; print('from the child', file=sys.stderr)"
    subprocess.run([sys.executable, "-c", child], stderr=logs.standard_error(), check=True)
    os.kill(os.getpid(), 9)
"""
    with PipeReader() as reader, program(reader, text) as process:
        assert process.wait(60) == -9
        reader.finish()
    assert "from the child\n" in reader.text


def test_lines_of_several_programs_stay_whole() -> None:
    text = """
with logs.written_apart("%(message)s"):
    sys.stdin.readline()
    for number in range(300):
        log.info("%s", "<" * 3000)
        time.sleep(0.0005)
"""
    with PipeReader() as reader, program(reader, text) as one, program(reader, text) as other:
        for process in (one, other):
            print(file=process.stdin, flush=True)
        assert (one.wait(60), other.wait(60)) == (0, 0)
        reader.finish()
    assert set(reader.text.splitlines()) == {"<" * 3000}


def test_a_program_that_was_started_without_them(tmp_path: Path) -> None:
    path = tmp_path / "done"
    text = (
        f"{BEGIN}{EVERY_WAY}os.closerange(0, 3)\n"
        "with logs.written_apart():\n    every_way(1)\n"
        f"assert not logs.dropped()\nopen({str(path)!r}, 'w').close()\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-c", text], env=environment, cwd=ROOT, check=True, timeout=60)
    assert path.exists()


def test_everything_is_given_back() -> None:
    before = sys.stdout, sys.stderr, logging.root.handlers[:], logging.root.level
    places = [os.fstat(number) for number in (1, 2)]
    with logs.written_apart():
        assert logs.standard_error() > 2
        assert isinstance(sys.stdout, io.TextIOBase) and sys.stdout is not before[0]
        assert sys.stderr.fileno() == 2
        assert not os.get_blocking(1) and not os.get_blocking(2)
    assert before == (sys.stdout, sys.stderr, logging.root.handlers, logging.root.level)
    assert places == [os.fstat(number) for number in (1, 2)]
    assert (logs.standard_error(), logs.dropped()) == (2, 0)


def test_a_line_has_an_end() -> None:
    text = f"with logs.written_apart('%(message)s'):\n    log.info('x' * {10 * LONGEST})\n"
    with PipeReader() as reader:
        run(reader, text)
        reader.finish()
    assert reader.text == f"{'x' * LONGEST} … ({9 * LONGEST} more characters)\n"
