"""What a request brings stays inside its own line of the log."""

import logging
import sys
from io import StringIO
from logging.config import dictConfig
from typing import Any

import pytest

from app.gateway.serve import LOG_CONFIG
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


def test_the_servers_log_is_made_so(monkeypatch: pytest.MonkeyPatch) -> None:
    out = StringIO()
    monkeypatch.setattr(sys, "stderr", out)
    config: dict[str, Any] = {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": LOG_CONFIG["formatters"],
        "handlers": LOG_CONFIG["handlers"],
        "loggers": {"test.forging": {"handlers": ["stderr"], "propagate": False, "level": "INFO"}},
    }
    dictConfig(config)
    try:
        logging.getLogger("test.forging").info("%s", "/a\n\x1b[0m")
    finally:
        logging.getLogger("test.forging").handlers.clear()
    assert out.getvalue().endswith("INFO /a\\n\\x1b[0m\n")
