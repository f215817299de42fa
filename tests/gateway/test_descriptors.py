"""How descriptors are divided, and what a low limit does."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from app.gateway.descriptors import LEAST, MOST, RESERVE, TIGHT, share

RAISE = """
import logging, resource, sys
from app.errors import CannotStart
from app.gateway.descriptors import raise_limit
logging.basicConfig()
soft, hard = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
try:
    print(raise_limit(), *resource.getrlimit(resource.RLIMIT_NOFILE))
except CannotStart as error:
    print(error.message)
"""


def limited(soft: int, hard: int) -> tuple[str, str]:
    done = subprocess.run(
        [sys.executable, "-c", RAISE, str(soft), str(hard)],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip(), done.stderr.strip()


def test_the_limit_is_raised_as_far_as_it_may_be() -> None:
    assert limited(300, 1024) == ("1024 1024 1024", "")
    out, err = limited(300, 300)
    assert out == "300 300 300"
    assert "this process may open 300 files" in err


def test_too_low_a_limit_is_one_clear_line() -> None:
    out, _ = limited(100, 128)
    assert out.startswith("this process may open 128 files, too few")
    assert f"at least {LEAST}" in out and "LimitNOFILE" in out


@pytest.mark.parametrize("limit", [LEAST, 512, 1024, 4096, MOST])
def test_strangers_leave_room_for_files_and_for_who_is_signed_in(limit: int) -> None:
    shares = share(limit, 60, 256)
    assert 60 + shares.connections + RESERVE <= limit
    assert shares.strangers <= shares.connections // 2
    assert shares.strangers == 256 or limit <= 1024


def test_even_a_full_process_can_be_connected_to() -> None:
    assert share(LEAST, LEAST, 256) == (16, 8)


def test_the_unit_in_the_docs_gives_what_is_asked_for() -> None:
    text = (Path(__file__).parents[2] / "docs" / "deploy.md").read_text()
    unit = dict(re.findall(r"^(\w+)=(.*)$", text.split("```ini")[1].split("```")[0], re.MULTILINE))
    assert int(unit["LimitNOFILE"]) == MOST
    assert unit["UMask"] == "0077"
    assert f"warns below {TIGHT}, and does not start below {LEAST}" in text
    assert f"at least {RESERVE}" in text
