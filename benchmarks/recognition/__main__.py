"""Recognition on photographs: accuracy and time of every mode and of MediaPipe Hands, in one run.

::

    python -m benchmarks.recognition ../shared/data/digits ../shared/data/webcam-box \
        --trials 10 --save benchmarks/recognition.json --markdown recognition.md

``video`` is the second of two frames in which the photograph moves by 2 pixels: the product's
network looks at the part where the hand was, MediaPipe follows the hand without looking for it.
Every photograph goes through every method before the next one does, in an order that rotates, with
this process and the peer's on the same one core: what disturbs the machine disturbs all. The draws
of the trials are the same for all. With rooms or people known (digits, webcam-*, ``--group``),
half of them are enrolled from and the other half asked. A hand that is not found counts as wrong;
a photograph without one is not enrolled while others are left.

MediaPipe Hands 0.10.14 (``--peer-env``, set up on first use): static pictures, one hand, directions
of the 20 bones, nearest neighbour. What each step of the product gives is measured by
``benchmarks.ablation``.

The networks that are shipped were trained on all photographs of ``shared/data``, so that figures on
them flatter. ``--held --model FILE --shape-model FILE`` takes the rooms and people that
``training/photos.py`` keeps aside, and networks that did not see them.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import importlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
import simplejpeg

from benchmarks.recognition.methods import Landmarks, Method, Product, Seen
from benchmarks.recognition.modes import compared
from benchmarks.recognition.peer import Peer, default_environment
from benchmarks.recognition.score import Look, accuracy, across, rejection
from benchmarks.recognition.sets import PhotoSet, read_set
from benchmarks.recognition.table import PEER, markdown

VIDEO_EVERY = 4
"""Following a hand is timed on one of so many photographs."""
DRIFT = 2
"""Pixels by which the hand moves between the two frames of it."""


def main() -> None:
    options = parse()
    cv2.setNumThreads(1)
    replace_networks(options)
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    methods: dict[str, Method] = {name: Product(values) for name, values in compared().items()}
    peer: Peer | None = None
    if not options.no_peer:
        peer = Peer(options.peer_env, options.peer_confidence)
        methods[PEER] = Landmarks(peer)
    sets = [
        read_set(path, options.group, options.every, options.held) for path in options.directories
    ]
    result: dict[str, Any] = {
        "trials": options.trials,
        "seed": options.seed,
        "held": options.held,
        "model": options.model and options.model.name,
        "shape_model": options.shape_model and options.shape_model.name,
        "peer": peer
        and {"version": peer.version, "min_detection_confidence": options.peer_confidence},
        "sets": {},
        "across": {},
    }
    looks: dict[str, Look] = {}
    for photos in sets:
        looks[photos.name], video = look(photos, methods)
        result["sets"][photos.name] = {
            **about(photos),
            "methods": measured(photos, looks[photos.name], video, methods, options),
        }
        write(result, options)
    if peer is not None:
        peer.close()
    for a in sets:
        for b in sets:
            if options.across and a is not b and set(a.labels) & set(b.labels):
                result["across"][f"{a.name}, asked about {b.name}"] = across(
                    a, b, looks, methods, options.trials, options.seed
                )
    write(result, options)
    print(markdown(result))


def write(result: Mapping[str, Any], options: argparse.Namespace) -> None:
    """Write what there is so far; a run takes long, and may be cut short."""
    if options.save:
        options.save.write_text(json.dumps(result, indent=1) + "\n")
    if options.markdown:
        options.markdown.write_text(markdown(result))


def replace_networks(options: argparse.Namespace) -> None:
    """Put other networks in place of those shipped; each is read when first needed."""
    for module, name, file in (
        ("mask", "MODEL", options.model),
        ("features", "SHAPE_MODEL", options.shape_model),
    ):
        if file is not None:
            vars(importlib.import_module(f"app.pipeline.{module}"))[name] = str(file.resolve())


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("directories", type=Path, nargs="+", help="LABEL/*.jpg")
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--group", metavar="REGEX", help="room or person in a file name")
    parser.add_argument("--every", type=int, default=1, help="use one photo of so many")
    parser.add_argument(
        "--held", action="store_true", help="only the rooms and people that training keeps aside"
    )
    parser.add_argument(
        "--model", type=Path, help="ONNX file of a mask network in place of the one shipped"
    )
    parser.add_argument("--shape-model", type=Path, help="the same for the shape network")
    parser.add_argument(
        "--across", action="store_true", help="also enrol from one set and ask about another"
    )
    parser.add_argument("--no-peer", action="store_true", help="without MediaPipe")
    parser.add_argument("--peer-env", type=Path, default=default_environment(), metavar="DIR")
    parser.add_argument("--peer-confidence", type=float, default=0.5, help="to detect a hand")
    parser.add_argument("--save", type=Path, help="write the figures to this JSON file")
    parser.add_argument("--markdown", type=Path, help="write the tables to this file")
    return parser.parse_args()


def look(photos: PhotoSet, methods: Mapping[str, Method]) -> tuple[Look, Look]:
    """What every method sees in every photograph, and in some of them as frames of a video."""
    seen: dict[str, list[Seen]] = {name: [] for name in methods}
    video: dict[str, list[Seen]] = {name: [] for name in methods}
    order = list(methods)
    with TemporaryDirectory() as folder:
        frames = Path(folder) / "before.jpg", Path(folder) / "after.jpg"
        for number, path in enumerate(photos.paths):
            for name in order:
                if number < 3:  # To warm up.
                    methods[name].see(path)
                seen[name].append(methods[name].see(path))
            if number % VIDEO_EVERY == 0 and drift(path, *frames):
                for name in order:
                    video[name].append(methods[name].follow(*frames))
            order.append(order.pop(0))
    return seen, video


def drift(path: Path, before: Path, after: Path) -> bool:
    """Write two frames of a video in which the photograph moves; False when it is unreadable."""
    picture = cv2.imread(str(path))
    if picture is None or min(picture.shape[:2]) <= 2 * DRIFT:
        return False
    for frame, part in ((before, picture[DRIFT:, DRIFT:]), (after, picture[:-DRIFT, :-DRIFT])):
        pixels = np.ascontiguousarray(part, np.uint8)
        frame.write_bytes(simplejpeg.encode_jpeg(pixels, 85, "BGR", colorsubsampling="420"))
    return True


def measured(
    photos: PhotoSet,
    looks: Look,
    video: Look,
    methods: Mapping[str, Method],
    options: argparse.Namespace,
) -> dict[str, dict[str, Any]]:
    """Method to all of its figures on one set."""
    marks = accuracy(photos, looks, methods, options.trials, options.seed)
    curves = rejection(photos, looks, methods, options.trials, options.seed)
    return {
        name: {
            "accuracy": marks[name],
            "no_hand": float(np.mean([seen.hand is None for seen in looks[name]])),
            "photo": times(looks[name], marks[name].get("match_ms", 0.0)),
            "video": times(video[name], marks[name].get("match_ms", 0.0)),
            "rejection": curves[name],
        }
        for name in methods
    }


def times(seen: Sequence[Seen], match_ms: float) -> dict[str, float] | None:
    """Percentiles of the time from bytes to hand, plus that from hand to answer.

    Only of the photographs in which a hand was found: what stops early is fast.
    """
    found = [photo for photo in seen if photo.hand is not None]
    if not found:
        return None
    wall = np.array([photo.wall_ms for photo in found]) + match_ms
    return {
        "wall_ms_p50": float(np.percentile(wall, 50)),
        "wall_ms_p99": float(np.percentile(wall, 99)),
        "cpu_ms_p50": float(np.median([photo.cpu_ms for photo in found])) + match_ms,
    }


def about(photos: PhotoSet) -> dict[str, Any]:
    """What the set holds; ``rooms`` only where they are few."""
    counts = Counter(photos.groups or ())
    few = 0 < len(counts) <= 20
    return {
        "photos": len(photos.paths),
        "labels": len(set(photos.labels)),
        "groups": len(counts),
        "kind": "rooms" if few else "people",
        "rooms": dict(sorted(counts.items())) if few else None,
    }


if __name__ == "__main__":
    main()
