"""A million messages that nobody should send: no uncaught error, refused at once, no growth.

Texts for the operator's and the cameras' sockets, frames with their header and JPEG, and payloads
of the link, each made from a sound one: bytes flipped, cut, repeated, swapped with another's;
numbers made huge, tiny or no numbers; fields renamed, nested or left out. A frame that is refused
is timed, from its bytes to the refusal:

    python -m benchmarks.fuzz_messages --inputs 1000000

Must hold: nothing but the errors that each parser names; a bad frame refused within 5 ms (of the
processor's time); memory grows by under 50 MiB after the first tenth.
"""

import json
import random
import time
from collections import Counter

import numpy as np
import psutil
import simplejpeg

from app.config import DecodeSettings
from app.errors import FrameRefused, RequestError
from app.gateway.messages import parse_client_message
from app.gateway.picture_pace import acknowledged
from app.link.header import HEADER_SIZE, FrameHeader
from app.link.messages import Command, DryRunRequest, LeaseRequest, StopRequest
from app.link.reading import decode
from app.pipeline.decode import Decode
from benchmarks.report import arguments, promise, report

MAX_MS = 5.0
MAX_MIB = 50.0
TEXTS: tuple[dict[str, object], ...] = (
    {"type": "take_control", "takeover": True},
    {"type": "hand_over", "to": "operator-1a2b3c"},
    {"type": "view", "detail": True, "glass": True},
    {"type": "speed", "scale": 0.5},
    {"type": "picture", "camera": "wrist", "tick": 12345},
    {"type": "ping", "t": 12.5},
    {"type": "arm"},
    {"type": "stop"},
    {"type": "shown", "seq": 7},
)
JOG = {"type": "jog_cartesian", "frame": "base", "linear": [0.1, 0, 0], "angular": [0, 0, 0]}
LINK: tuple[tuple[type[Command | LeaseRequest | StopRequest | DryRunRequest], object], ...] = (
    (Command, {"epoch": 1, "sequence": 2, "tick": 3, "gesture": "left", "action": JOG}),
    (LeaseRequest, {"kind": "take", "holder": "operator-1"}),
    (StopRequest, {"source": "operator-1", "reason": "button"}),
    (DryRunRequest, {"action": {"type": "sequence", "steps": [JOG | {"duration": 1.0}]}}),
)
VALUES: tuple[object, ...] = (
    *(0, -1, 1e308, -1e-320, 2**63, 2**64, 10**400, float("nan"), float("inf"), True, None),
    *("", "\0", "\ud800", "x" * 5000, [], {}, [[]], {"type": "arm"}, "stop"),
)


class Fuzz:
    """Makes one input after another and gives it to its parser."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self.errors: Counter[str] = Counter()
        self.example = ""
        self.slowest_ms = 0.0
        self._decode = Decode(DecodeSettings())
        noise = np.random.default_rng(seed)
        self._pictures = [
            simplejpeg.encode_jpeg(
                noise.integers(0, 255, (height, width, 3), np.uint8), quality=quality
            )
            for width, height, quality in ((64, 48, 30), (160, 120, 20), (320, 240, 10))
        ]

    def once(self) -> None:
        """One input of a random kind."""
        kind = self.rng.choice((self._text, self._shown, self._frame, self._link))
        try:
            kind()
        except Exception as error:
            self.errors[f"{kind.__name__.strip('_')}: {type(error).__name__}"] += 1
            self.example = self.example or repr(error)[:300]

    def _text(self) -> None:
        try:
            parse_client_message(self._broken_json(self._any_text()))
            self.counts["text: read"] += 1
        except RequestError:
            self.counts["text: refused"] += 1

    def _shown(self) -> None:
        read = acknowledged(self._broken_json(self._any_text()))
        self.counts["shown: refused" if read is None else "shown: read"] += 1

    def _link(self) -> None:
        kind, value = self.rng.choice(LINK)
        text = self._broken_json(value).encode("utf-8", "surrogatepass")
        data = self._broken_bytes(text) if self.rng.random() < 0.3 else text
        read = decode(kind, data)
        self.counts["link: refused" if read is None else "link: read"] += 1

    def _frame(self) -> None:
        header = FrameHeader(self.rng.getrandbits(32), self.rng.random() * 1e6, 1).pack()
        message = self._broken_bytes(header + self.rng.choice(self._pictures))
        began = time.thread_time()
        try:
            FrameHeader.unpack(message)
            self._decode(message[HEADER_SIZE:])
        except FrameRefused:
            self.slowest_ms = max(self.slowest_ms, 1e3 * (time.thread_time() - began))
            self.counts["frame: refused"] += 1
        else:
            self.counts["frame: read"] += 1

    def _any_text(self) -> dict[str, object]:
        return dict(self.rng.choice(TEXTS))

    def _broken_json(self, value: object) -> str:
        rng = self.rng
        if isinstance(value, dict) and rng.random() < 0.8:
            value = dict(value)
            name = rng.choice(list(value))
            match rng.randrange(4):
                case 0:
                    del value[name]
                case 1:
                    value[rng.choice(("x", "", "__proto__", "type\0"))] = value.pop(name)
                case _:
                    value[name] = rng.choice(VALUES)
        text = json.dumps(value)
        if rng.random() < 0.05:
            depth = rng.choice((10, 1000, 4000))
            text = "[" * depth + text
        if rng.random() < 0.3:
            at = rng.randrange(len(text) + 1)
            text = text[:at] + chr(rng.randrange(0x110000)) + text[at + rng.randrange(3) :]
        return text

    def _broken_bytes(self, data: bytes) -> bytes:
        rng = self.rng
        broken = bytearray(data)
        for _ in range(rng.choice((0, 1, 1, 1, 2, 4, 16))):
            if not broken:
                break
            at = rng.randrange(min(len(broken), rng.choice((24, 700, len(broken)))))
            match rng.randrange(6):
                case 0:
                    del broken[at:]
                case 1:
                    del broken[at : at + rng.randrange(1, 64)]
                case 2:
                    broken[at:at] = broken[at : at + rng.randrange(1, 4000)]
                case 3:
                    broken[at : at + 2] = rng.randbytes(2)
                case 4:
                    broken[at:at] = bytes((0xFF, rng.randrange(256)))
                case _:
                    broken[at] ^= 1 << rng.randrange(8)
        return bytes(broken)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--inputs", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    fuzz = Fuzz(options.seed)
    process = psutil.Process()
    began = time.monotonic()
    first = 0
    for number in range(options.inputs):
        fuzz.once()
        if number == options.inputs // 10:
            first = process.memory_info().rss
    grown = (process.memory_info().rss - first) / 2**20
    wrong = sum(fuzz.errors.values())
    rows: dict[str, dict[str, float | str]] = {
        "inputs": {"n": options.inputs, "s": time.monotonic() - began} | dict(fuzz.counts),
        "uncaught": {
            "n": wrong,
            **promise("0", kept=not wrong),
            **{name: float(count) for name, count in fuzz.errors.items()},
        },
        "slowest refusal of a frame": {
            "ms": fuzz.slowest_ms,
            **promise(f"{MAX_MS:g} ms", kept=fuzz.slowest_ms <= MAX_MS),
        },
        "memory": {"MiB": grown, **promise(f"under {MAX_MIB:g}", kept=grown < MAX_MIB)},
    }
    report(rows, options)
    print(fuzz.example)


if __name__ == "__main__":
    main()
