"""Thousands of requests made up from the API's own document, against a real server with its robot.

schemathesis reads ``/openapi.json`` and sends what the document allows, and what it forbids, alone
and in sequences. It has an environment of its own, made by ``uv`` when this is run::

    python -m benchmarks.api_cases [--examples 200] [--seed 1] [--save FILE]

Must hold: no answer of 500, no way round the sign-in (``ignored_auth``), nothing said that the
document does not say. Left out, with the reason:

- ``positive_data_acceptance``: the document cannot say that an image shows a hand, or that an
  action has the fields of its type, so that much of what it allows is rightly refused with 422.
- ``allow_header_conformance``: a path such as ``/api/gestures/check`` is also ``{id}``'s, whose
  methods its 405 names.
- The endless answers of ``.mjpeg``.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.report import arguments, promise, report
from tests.e2e.running import TOKEN, start_server, stop_server

ROOT = Path(__file__).parents[1]
TOOL = "schemathesis==4.32.5"
LEFT_OUT = "positive_data_acceptance,allow_header_conformance"
PHASES = "examples,coverage,fuzzing,stateful"


def cases(url: str, examples: int, seed: int, folder: Path) -> tuple[int, list[str], str]:
    """Run them; gives how many there were, what was found, and the tool's words.

    Args:
        url: Of the server.
        examples: At most this many a route.
        seed: Of what is made up.
        folder: Where the tool may leave what it keeps.
    """
    done = subprocess.run(
        [
            str(Path(sys.executable).parent / "uv"), "tool", "run", "--from", TOOL,
            "schemathesis", "run", f"{url}/openapi.json",
            "--header", f"Authorization: Bearer {TOKEN}",
            "--checks", "all", "--exclude-checks", LEFT_OUT, "--phases", PHASES,
            "--exclude-path-regex", "mjpeg", "--max-examples", str(examples),
            "--seed", str(seed), "--continue-on-failure", "--no-color",
        ],
        cwd=folder,
        env={
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "SCHEMATHESIS_HOOKS": "benchmarks.api_hooks",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )  # fmt: skip
    count = re.search(r"(\d[\d,]*) generated", done.stdout)
    if count is None:
        raise RuntimeError(f"no cases were made:\n{done.stdout[-2000:]}")
    # A route that could not be tried is no route without a fault.
    found = re.findall(r"^\s+(?:❌|🚫) ((?:ST\d+|[A-Z]).+: \d+)$", done.stdout, re.MULTILINE)
    return int(count[1].replace(",", "")), found, done.stdout


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--examples", type=int, default=200, help="at most this many a route")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            count, found, words = cases(server.url, options.examples, options.seed, Path(folder))
            log = server.log.read_text()
        finally:
            stop_server(server)
    failed = log.count("Traceback")
    print(words)
    report(
        {
            "cases": {"n": count},
            "found": {"n": len(found), "what": "; ".join(found), **promise("0", kept=not found)},
            "errors in the server's log": {"n": failed, **promise("0", kept=not failed)},
        },
        options,
    )


if __name__ == "__main__":
    main()
