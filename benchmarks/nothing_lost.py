"""No gesture is lost: a server killed while gestures are enrolled, a full disk, a damaged file.

::

    python -m benchmarks.nothing_lost --kills 300 --full 50 --damaged 100

The server is ``farhand serve`` in a process of its own, without a robot and a 3D view, and the
gestures are enrolled over its REST API with a drawn hand.

- ``killed``: SIGKILL at a random moment while two clients enrol one gesture after the other. Must
  hold: every gesture that was answered with 201 is there with all its samples, none is there with
  fewer, SQLite's integrity check and all checksums are clean.
- ``full``: the data folder lies on a file system of 64 MiB that is filled up at a random moment.
  Must hold: each answer is 201 or 507, what was answered with 201 is there and nothing else is, and
  once there is space again a gesture is enrolled. Needs the right to mount one; without it the row
  is left out.
- ``damaged``: bytes of the database are flipped, or it is cut, while no server runs. Must hold: the
  server answers within 5 s, counted from when its process begins; either what was taught is there
  unchanged, or the server says what is wrong, and then the damaged file is kept as it was and the
  last backup is good.

A row's ``worst`` is the longest start in seconds.
"""

import argparse
import contextlib
import json
import os
import random
import signal
import sqlite3
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx

from app.gestures import GestureStore, backup
from app.gestures.backup import Place
from app.gestures.hand import POSES, HandView, render_hand
from benchmarks.report import arguments, promise, report
from tests.conftest import fill
from tests.e2e.running import TOKEN, Server, start_server

SAMPLES = 2
START_S = 5.0
BEARER = {"Authorization": f"Bearer {TOKEN}"}
ALONE = {
    **os.environ,
    "FARHAND_ROBOT__SPAWN": "false",
    "FARHAND_ROBOT__ENDPOINT": "unixsock-stream//nonexistent/link",
    "FARHAND_GATEWAY__VISER": "false",
    "FARHAND_GATEWAY__READY_WAIT_S": "0",
}


def photographs() -> list[bytes]:
    """JPEGs of a hand, each turned a little."""
    views = (HandView(270.0, turn=turn) for turn in (0.0, 5.0))
    pictures = (render_hand(POSES["stop"], view=view) for view in views)
    return [cv2.imencode(".jpg", picture)[1].tobytes() for picture in pictures]


@contextlib.contextmanager
def served(folder: Path) -> Iterator[tuple[Server, float]]:
    """A server, and in how many seconds it answered; killed at the end."""
    began = time.monotonic()
    server = start_server(folder, env=ALONE)
    try:
        with server.api() as api:
            api.get("/api/health").raise_for_status()
        yield server, time.monotonic() - began
    finally:
        server.process.send_signal(signal.SIGKILL)
        server.process.wait()
        assert server.process.stdout is not None
        server.process.stdout.close()


def place_in(folder: Path) -> Place:
    """Of the server's database."""
    return Place(folder / "data" / "gestures.db", folder / "data" / "backups")


def enrol(api: httpx.Client, name: str, images: list[bytes]) -> int:
    """Enrol a gesture; returns the status of the answer."""
    files = [("images", (f"{n}.jpg", image, "image/jpeg")) for n, image in enumerate(images)]
    fields = {"name": name, "action": '{"type":"home"}'}
    return api.post("/api/gestures", data=fields, files=files).status_code


def whole(path: Path) -> dict[str, int]:
    """Names and numbers of samples of a database that passes every check.

    Raises:
        DatabaseBroken: it passes one not.
    """
    with contextlib.closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    with contextlib.closing(GestureStore(f"sqlite:///{path}", None)) as store:
        return {gesture.name: len(gesture.samples) for gesture in store.list()}


def killed(folder: Path, times: int, rng: random.Random) -> dict[str, Any]:
    """Kill the server at random moments of enrolling, on one database over and over."""
    images = photographs()
    known: set[str] = set()
    acknowledged, unanswered, kept_unanswered, worst = 0, 0, 0, 0.0
    lost: list[str] = []
    half: list[str] = []
    for number in range(times):
        done: list[str] = []
        asked: list[str] = []
        with served(folder) as (server, seconds):
            worst = max(worst, seconds)
            clients = [
                threading.Thread(
                    target=_enrol_for_ever, args=(server, f"{number} {who}", images, asked, done)
                )
                for who in range(2)
            ]
            with server.api() as api:
                # Room for new ones; a removed gesture must stay removed.
                for gesture in api.get("/api/gestures").json():
                    if gesture["name"] in known and rng.random() < 0.5:
                        api.delete(f"/api/gestures/{gesture['id']}").raise_for_status()
                        known.discard(gesture["name"])
            for client in clients:
                client.start()
            # So many answers first, so that a slow machine acknowledges something, too.
            answers, deadline = rng.randrange(5), time.monotonic() + 30
            while len(done) < answers and time.monotonic() < deadline:
                time.sleep(0.005)
            time.sleep(rng.uniform(0.0, 0.4))
            server.process.send_signal(signal.SIGKILL)
            for client in clients:
                client.join()
        there = whole(place_in(folder).database)
        taught = {name: count for name, count in there.items() if name[0].isdigit()}
        expected = known | set(done)
        lost += sorted(expected - taught.keys())
        half += [name for name, count in taught.items() if count != SAMPLES]
        half += sorted(taught.keys() - known - set(asked))  # a removed one came back
        acknowledged += len(done)
        unanswered += len(asked) - len(done)
        kept_unanswered += len(taught.keys() - expected)
        known = set(taught)
        print(f"killed {number + 1}: {len(done)} acknowledged, {len(lost)} lost", flush=True)
    return {
        "times": times,
        "acknowledged": acknowledged,
        "unanswered": unanswered,
        "of these whole": kept_unanswered,
        "lost": len(lost),
        "half": len(half),
        "worst": worst,
        **promise("0 lost, 0 half", kept=not lost and not half and acknowledged > 0),
    }


def _enrol_for_ever(
    server: Server, prefix: str, images: list[bytes], asked: list[str], done: list[str]
) -> None:
    with server.api() as api:
        for number in range(1000):
            name = f"{prefix} {number}"
            asked.append(name)
            try:
                if enrol(api, name, images) == 201:
                    done.append(name)
            except httpx.HTTPError:
                return


ON_ONE_DISK = 25
"""Times that one disk is filled."""


@contextlib.contextmanager
def small_disk() -> Iterator[Path]:
    """A file system of 64 MiB: gestures, backups and the timeline have room on it.

    Raises:
        OSError, subprocess.CalledProcessError: it cannot be mounted.
    """
    with tempfile.TemporaryDirectory() as folder:
        options = ["-t", "tmpfs", "-o", "size=64m,mode=700", "tmpfs", folder]
        subprocess.run(["mount", *options], check=True)
        try:
            yield Path(folder)
        finally:
            subprocess.run(["umount", "-l", folder], check=True)


def full(times: int, rng: random.Random) -> dict[str, Any]:
    """Fill the disk before every write of a server that goes on running.

    What was deleted leaves room inside the database's own files, so that sooner or later a server
    can enrol on a disk without any: after :data:`ON_ONE_DISK` times a new one begins.
    """
    answers: dict[int, int] = {}
    wrong: list[str] = []
    worst = 0.0
    for first in range(0, times, ON_ONE_DISK):
        with small_disk() as folder, served(folder) as (server, seconds), server.api() as api:
            worst = max(worst, seconds)
            for number in range(first, min(first + ON_ONE_DISK, times)):
                wrong += _fill_and_enrol(folder, api, number, rng, answers)
                print(f"full {number + 1}: {answers}", flush=True)
            database = api.get("/api/health").json()["database"]
            if database != "ok":
                wrong.append(database)
    print(*wrong, sep="\n", flush=True)
    return {
        "times": times,
        "acknowledged": answers.get(201, 0),
        "answered 507": answers.get(507, 0),
        "wrong": len(wrong),
        "worst": worst,
        **promise("507, nothing changed", kept=not wrong),
    }


def _fill_and_enrol(
    folder: Path, api: httpx.Client, number: int, rng: random.Random, answers: dict[int, int]
) -> list[str]:
    """Enrol on a disk that is full, and on one that is not; leaves what was there before.

    Returns:
        What was not as it must be.
    """
    images = photographs()
    wrong: list[str] = []
    there = {gesture["name"] for gesture in api.get("/api/gestures").json()}
    filler = fill(folder, leave=rng.choice((0, 0, 4096, 16384, 65536)))
    status = 201
    for again in range(40):
        name = f"{number} {again}"
        status = enrol(api, name, images)
        answers[status] = answers.get(status, 0) + 1
        if status != 201:
            break
        there.add(name)
    listed = {gesture["name"] for gesture in api.get("/api/gestures").json()}
    if status != 507 or listed != there:
        wrong.append(f"{number}: {status}, {sorted(listed ^ there)}")
    filler.unlink()
    if enrol(api, f"{number} free", images) != 201:
        wrong.append(f"{number}: not even with space")
    for gesture in api.get("/api/gestures").json():
        if gesture["name"][0].isdigit():
            api.delete(f"/api/gestures/{gesture['id']}").raise_for_status()
    return wrong


def damaged(folder: Path, times: int, rng: random.Random) -> dict[str, Any]:
    """Flip bytes of the database or cut it, and start a server on it."""
    place = place_in(folder)
    with served(folder) as (server, _), server.api() as api:
        assert enrol(api, "mine", photographs()) == 201
        taught = api.get("/api/gestures").json()
    assert len(whole(place.database)) == len(taught)
    backup.make(place, 5)
    for path in backup.files_of(place.database)[1:]:
        path.unlink(missing_ok=True)
    sound = place.database.read_bytes()
    kept = {path.name: path.read_bytes() for path in place.backups.iterdir()}
    aside, refused, unharmed, slow, worst = 0, 0, 0, 0, 0.0
    wrong: list[str] = []
    for number in range(times):
        data, story = _damage(sound, rng)
        for path in place.database.parent.glob("gestures.*"):
            path.unlink()
        for path in place.backups.iterdir():
            path.unlink()
        for name, content in kept.items():
            (place.backups / name).write_bytes(content)
        place.database.write_bytes(data)
        try:
            with served(folder) as (server, seconds), server.api() as api:
                problem = api.get("/api/health").json()["database"]
                there = api.get("/api/gestures")
        except (AssertionError, httpx.HTTPError) as error:
            wrong.append(f"{story}: it does not start: {error}")
            continue
        worst = max(worst, seconds)
        slow += seconds > START_S
        copies = list(place.database.parent.glob("gestures.db.broken-*Z"))
        if problem == "ok":
            unharmed += 1
            if there.json() != taught:
                wrong.append(f"{story}: it serves other gestures and says nothing")
        elif copies:
            aside += 1
            if [path.read_bytes() for path in copies] != [data]:
                wrong.append(f"{story}: what was set aside is not what was there")
        else:
            refused += 1
        if backup.check(backup.newest_good(place).path) != len(taught):
            wrong.append(f"{story}: the good backup is gone")
        print(f"damaged {number + 1}: {story}: {seconds:.1f} s, {problem[:60]}", flush=True)
    print(*wrong, sep="\n", flush=True)
    return {
        "times": times,
        "set aside": aside,
        "told": refused,
        "unharmed": unharmed,
        "over 5 s": slow,
        "wrong": len(wrong),
        "worst": worst,
        **promise(f"starts or sets aside in {START_S:g} s", kept=not wrong and not slow),
    }


def _damage(sound: bytes, rng: random.Random) -> tuple[bytes, str]:
    if rng.random() < 0.25:
        size = rng.randrange(len(sound))
        return sound[:size], f"cut to {size} bytes"
    data = bytearray(sound)
    count = rng.choice((1, 1, 4, 64, 1024))
    # A third within the first page, where what SQLite needs to read the rest stands.
    end = 4096 if rng.random() < 1 / 3 else len(data)
    places = [rng.randrange(end) for _ in range(count)]
    for at in places:
        data[at] ^= rng.randrange(1, 256)
    return bytes(data), f"{count} bytes flipped from {min(places)} on"


def main() -> None:
    """Do what is asked and print a row for each."""
    parser = arguments(__doc__)
    for name, default in (("kills", 300), ("full", 50), ("damaged", 100)):
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--seed", type=int, default=1)
    options: argparse.Namespace = parser.parse_args()
    rows: dict[str, dict[str, Any]] = {}
    if options.kills:
        with tempfile.TemporaryDirectory() as folder:
            rows["killed"] = killed(Path(folder), options.kills, random.Random(options.seed))
            print(json.dumps(rows), flush=True)
    if options.full:
        try:
            rows["full"] = full(options.full, random.Random(options.seed))
            print(json.dumps(rows), flush=True)
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"full: no file system may be mounted here ({error})")
    if options.damaged:
        with tempfile.TemporaryDirectory() as folder:
            rows["damaged"] = damaged(Path(folder), options.damaged, random.Random(options.seed))
    report(rows, options)


if __name__ == "__main__":
    main()
