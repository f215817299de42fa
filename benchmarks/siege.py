"""Everything at once that could hold a stop up: around a server, and against it.

- Standard error is a pipe that nobody reads, full from the start.
- The data folder is on a file system of its own, frozen (fsfreeze) while a stop is under way.
- Strangers, who are not signed in: connections that say nothing, as many as the server lets stand;
  heads of 24 MB; requests for what they may not see.
- Who is signed in: twenty viewers, a client that floods (:func:`benchmarks.estop.crowd`), and eight
  uploads of large pictures at a time.

Needs root, for the file system. The attackers are a process of their own with bounded rates, which
gives way to the server: they stand for other machines.
"""

import asyncio
import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import httpx
import numpy as np

from benchmarks.rig import TOKEN

LONGEST_S = 1800.0
"""The attackers end by themselves after this."""
SILENT = 2000
UPLOADS = 8
PICTURE = (3000, 4000, 3)
HEAD_BYTES = 24 << 20
REQUESTS_PER_S = 100


@contextmanager
def unread_pipe() -> Iterator[int]:
    """The writing end of a pipe that is full and that nobody reads."""
    reading, writing = os.pipe()
    try:
        flags = fcntl.fcntl(writing, fcntl.F_GETFL)
        fcntl.fcntl(writing, fcntl.F_SETFL, flags | os.O_NONBLOCK)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writing, b"\n" * 4096)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writing, b"\n")
        fcntl.fcntl(writing, fcntl.F_SETFL, flags)
        yield writing
    finally:
        os.close(reading)
        os.close(writing)


async def besiege(url: str) -> None:
    """Attack the server at ``url`` until killed."""
    host, port = httpx.URL(url).host, httpx.URL(url).port
    noise = np.random.default_rng(1).integers(0, 255, PICTURE, np.uint8)
    picture = cv2.imencode(".jpg", cv2.GaussianBlur(noise, (0, 0), 3))[1].tobytes()
    deadline = time.monotonic() + LONGEST_S

    async def silent() -> None:
        while time.monotonic() < deadline:
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection(host, port)
                await reader.read(1)
                writer.close()
            await asyncio.sleep(SILENT / 200)

    async def heads() -> None:
        while time.monotonic() < deadline:
            with contextlib.suppress(OSError):
                _, writer = await asyncio.open_connection(host, port)
                writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
                for _ in range(HEAD_BYTES >> 16):
                    writer.write(b"X-A: " + b"a" * ((1 << 16) - 7) + b"\r\n")
                    await writer.drain()
                writer.close()
            await asyncio.sleep(0.5)

    async def requests() -> None:
        async with httpx.AsyncClient(base_url=url, timeout=5) as stranger:
            while time.monotonic() < deadline:
                with contextlib.suppress(httpx.HTTPError):
                    await stranger.get("/api/robots")
                await asyncio.sleep(1 / REQUESTS_PER_S)

    async def uploads() -> None:
        headers = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "image/jpeg"}
        async with httpx.AsyncClient(base_url=url, headers=headers, timeout=120) as known:
            while time.monotonic() < deadline:
                with contextlib.suppress(httpx.HTTPError):
                    await known.post("/api/recognise", content=picture)
                await asyncio.sleep(0.05)

    async with asyncio.TaskGroup() as group:
        for number in range(SILENT):
            group.create_task(silent())
            if number % 50 == 0:
                await asyncio.sleep(0.1)
        group.create_task(heads())
        group.create_task(requests())
        for _ in range(UPLOADS):
            group.create_task(uploads())
        print("besieges", flush=True)
