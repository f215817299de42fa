"""Ten thousand guessed tokens, from the operator's own address, while the operator drives.

Half of the guesses come as a bearer, half by the sign-in form. Told: how many were answered before
the first 429, and the time from sending a webcam frame to its answer with and without the guesses.

    python -m benchmarks.guesses [--guesses 10000] [--save FILE]

Must hold: 429 from the sixth; no guess gets in; the operator's frames and REST requests go on being
answered.
"""

import asyncio
import secrets
import statistics
import tempfile
import time
from collections import Counter
from pathlib import Path

import httpx

from benchmarks.operator import Operator
from benchmarks.report import arguments, promise, report
from benchmarks.rig import TOKEN, clip
from tests.e2e.running import start_server, stop_server

ALONE_S = 5.0


async def guess(url: str, count: int) -> list[int]:
    """The status of each answer, one after another."""
    async with httpx.AsyncClient(base_url=url, timeout=20) as client:
        statuses = []
        for number in range(count):
            token = secrets.token_urlsafe(24)
            if number % 2:
                answer = await client.post("/signin", data={"token": token})
            else:
                bearer = {"Authorization": f"Bearer {token}"}
                answer = await client.get("/api/gestures", headers=bearer)
            statuses.append(answer.status_code)
        return statuses


async def measure(url: str, count: int) -> dict[str, dict[str, float | str]]:
    """The rows of the report."""
    own = {"Authorization": f"Bearer {TOKEN}"}
    pictures = clip("left").keep()  # made before: who is silent for 2 s loses control
    async with Operator(url, TOKEN) as operator:
        await operator.take_and_arm()
        showing = asyncio.create_task(operator.play(pictures))
        await asyncio.sleep(ALONE_S)
        alone = _answer_ms(operator)
        operator.frames.clear()
        began = time.monotonic()
        guessing = asyncio.create_task(guess(url, count))
        requests: Counter[int] = Counter()
        async with httpx.AsyncClient(base_url=url, headers=own, timeout=20) as client:
            while not guessing.done():
                requests[(await client.get("/api/gestures")).status_code] += 1
                await asyncio.sleep(0.2)
        took = time.monotonic() - began
        meanwhile = _answer_ms(operator)
        statuses = await guessing
        driving = bool(operator.robot["controller"]) and bool(operator.robot["armed"])
        showing.cancel()
        await asyncio.gather(showing, return_exceptions=True)
    first = statuses.index(429) + 1 if 429 in statuses else count + 1
    let_in = sum(status not in (401, 403, 429) for status in statuses)
    refused = sum(number for status, number in requests.items() if status != 200)
    return {
        "guesses": {"n": count, "s": took},
        "first 429": {"n": first, **promise("the 6th", kept=first <= 6)},
        "after it, not 429": {"n": sum(status != 429 for status in statuses[first - 1 :])},
        "let in": {"n": let_in, **promise("0", kept=not let_in)},
        "operator's requests refused": {
            "n": refused,
            "of": requests.total(),
            **promise("0", kept=not refused),
        },
        "operator drives throughout": {**promise("yes", kept=driving)},
        "frame to answer, median ms": {"alone": alone, "meanwhile": meanwhile},
    }


def _answer_ms(operator: Operator) -> float:
    took: list[float] = [
        frame["received"] - frame["sent"] for frame in operator.frames if frame["sent"]
    ]
    return 1e3 * float(statistics.median(took))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--guesses", type=int, default=10_000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            rows = asyncio.run(measure(server.url, options.guesses))
        finally:
            stop_server(server)
    report(rows, options)


if __name__ == "__main__":
    main()
