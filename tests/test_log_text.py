"""What a request brings stays inside its own line of the log."""

import logging
import subprocess
import sys
from io import StringIO

import pytest

from app.log_text import LineFormatter, printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("GET /api/robots 200", "GET /api/robots 200"),
        ("a\nb", "a\\nb"),
        ("a\r\nb", "a\\r\\nb"),
        ("\x1b[2J", "\\x1b[2J"),
        ("\x9b2J\x7f\x00", "\\x9b2J\\x7f\\x00"),
        ("a\u2028b\u2029c\x85d", "a\\u2028b\\u2029c\\x85d"),
        ("\u202egnp.exe", "\\u202egnp.exe"),
        ("\ud800", "\\ud800"),
        ("Grüße, Ünal 中 👍\t", "Grüße, Ünal 中 👍\t"),
    ],
)
def test_what_would_act_on_a_terminal_is_shown(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_nothing_that_is_logged_begins_a_line_of_its_own() -> None:
    out = StringIO()
    handler = logging.StreamHandler(out)
    handler.setFormatter(LineFormatter("%(levelname)s %(message)s"))
    log = logging.Logger("forging")
    log.addHandler(handler)
    forged = "\nINFO POST /api/robots/puma/stop 200\x1b[1A"
    log.info("%s %s", "GET", forged)
    try:
        raise ValueError(forged)
    except ValueError:
        log.exception("failed %s", forged, stack_info=True)
    lines = out.getvalue().splitlines()
    assert "\x1b" not in out.getvalue()
    begun = [line for line in lines if not line.startswith("  ")]
    assert [line.partition(" ")[0] for line in begun] == ["INFO", "ERROR"]
    assert any("ValueError" in line for line in lines)


PROCESS = """
import logging
from app.logs import written_apart
with written_apart():
    logging.getLogger("forging").info("%s", "/a\\n\\x1b[0m")
"""


def test_the_log_of_our_processes_is_made_so() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", PROCESS], capture_output=True, text=True, check=True, timeout=120
    )
    assert ended.stderr.endswith("INFO /a\\n\\x1b[0m\n")
    assert len(ended.stderr.splitlines()) == 1
