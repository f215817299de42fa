"""Bad input: every file gets an answer or a clear refusal, in bounded time and memory.

::

    python -m benchmarks.fuzz_images --files 10000 --save benchmarks/fuzz_images.json

Each file of :mod:`benchmarks.mutated_images` goes to ``extract_template`` (as a photograph for
enrolment) and through a ``Pipeline`` (as a webcam frame after others), in the product's settings
and, where there are several, in each mode of ``binarise``. Allowed are an answer that holds
together, and ImageRefused, TooLarge or FrameRefused with one plain sentence. The work is done in a
process of its own, so that a crash is seen and named. Must hold: no other exception, no crash,
at most 2 s of processor time and 500 MiB for any file.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import multiprocessing
import time
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, get_args

import cv2
import numpy as np

from app.config import BinariseSettings, PipelineSettings
from app.errors import FrameRefused, ImageRefused, TooLarge
from app.pipeline import Gallery, PcaMatcher, Pipeline, extract_template
from app.pipeline.types import Extraction, FrameResult
from benchmarks.mutated_images import hand, jpeg, mutated
from benchmarks.report import arguments, report

MAX_SECONDS = 2.0
MAX_MIB = 500.0
PATIENCE = 60.0
"""Seconds after which a file's process is killed: by then it hangs."""


class Subject:
    """The product as the fuzz sees it: photographs and frames in every mode."""

    def __init__(self) -> None:
        field = BinariseSettings.model_fields.get("mode")
        modes = get_args(field.annotation) if field else ()
        self.settings = [
            PipelineSettings.model_validate({"binarise": {"mode": mode}} if mode else {})
            for mode in modes or (None,)
        ]
        template = np.zeros((80, 60), np.uint8)
        template[20:, 15:45] = 1
        gallery = Gallery(("a",), template[None])
        self.pipelines = [
            Pipeline(settings, PcaMatcher.fit(gallery, settings.match))
            for settings in self.settings
        ]
        self._count = 0

    def try_file(self, data: bytes) -> list[str]:
        """Give one file to everything.

        Returns:
            What came of it: ``answer``, or the name of the refusal, once for each way.

        Raises:
            AssertionError: an answer or a message that does not hold together.
            Exception: whatever the product raised besides its refusals.
        """
        self._count += 1
        outcomes = []
        for settings, pipeline in zip(self.settings, self.pipelines, strict=True):
            try:
                check_extraction(extract_template(data, settings, whole=self._count % 2 == 0))
                outcomes.append("photo: answer")
            except (ImageRefused, TooLarge) as error:
                check_message(error.message)
                outcomes.append(f"photo: {type(error).__name__}")
            try:
                now = self._count / 30
                check_result(pipeline(data, seq=self._count, now=now))
                outcomes.append("frame: answer")
                # At rest, the later stages run, too.
                for later in (1, 2):
                    check_result(pipeline(data, seq=self._count, now=now + later / 100))
            except FrameRefused as error:
                check_message(error.message)
                outcomes.append("frame: FrameRefused")
        return outcomes


def check_message(message: str) -> None:
    """One line that a person can read."""
    assert 10 < len(message) < 250, message
    assert message.isprintable(), message


def check_extraction(found: Extraction) -> None:
    """Shapes, values and bounds of what was found in a photograph."""
    assert found.template.shape == (80, 60), found.template.shape
    assert found.template.any(), "empty template"
    assert found.mask.max() == 1 and found.views.max() <= 1, "not 0 and 1"
    x, y, width, height = found.roi
    assert x >= 0 and y >= 0 and width > 0 and height > 0, found.roi
    assert x + width <= found.width and y + height <= found.height, found.roi


def check_result(result: FrameResult) -> None:
    """Figures and bounds of what a frame led to."""
    assert result.mask.max(initial=0) <= 1, "not 0 and 1"
    if result.reason is not None:
        check_message(result.reason)
    if result.match is not None:
        assert np.isfinite((result.match.distance, result.match.error)).all(), result.match
    if result.roi is not None:
        assert min(result.roi[:2]) >= 0 and min(result.roi[2:]) > 0, result.roi


def peak_mib() -> float:
    """Most memory this process has held since :func:`forget_peak`; Linux."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return 0.0


def forget_peak() -> None:
    """Count the peak anew; see proc(5), clear_refs."""
    Path("/proc/self/clear_refs").write_text("5")


def work(pipe: Connection, seed: int) -> None:
    """The process that is tried: file numbers in, what came of them out."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # The decoders' own complaints.
    cv2.setNumThreads(1)
    subject = Subject()
    subject.try_file(jpeg(hand(640, 480, np.random.default_rng(0)), np.random.default_rng(0)))
    while (number := pipe.recv()) is not None:
        data, story = mutated(seed, number)
        forget_peak()
        before, cpu, wall = peak_mib(), time.process_time(), time.perf_counter()
        outcomes, fault = [], None
        try:
            outcomes = subject.try_file(data)
        except Exception as error:  # The very thing that is looked for.
            fault = f"{type(error).__name__}: {error}"
        pipe.send(
            {
                "outcomes": outcomes,
                "fault": fault,
                "story": story,
                "bytes": len(data),
                # Each way and mode on its own is a file's work.
                "cpu_s": (time.process_time() - cpu) / len(subject.settings),
                "wall_s": time.perf_counter() - wall,
                "mib": peak_mib() - before,
            }
        )


def run(files: int, seed: int, first: int = 0) -> list[dict[str, Any]]:
    """Try the files; a crash or a hang becomes a fault and a new process goes on."""
    context = multiprocessing.get_context("spawn")
    results: list[dict[str, Any]] = []
    process, pipe = None, None
    for number in range(first, first + files):
        if process is None or pipe is None:
            pipe, end = context.Pipe()
            process = context.Process(target=work, args=(end, seed), daemon=True)
            process.start()
            end.close()
        result: dict[str, Any]
        try:
            pipe.send(number)
            if not pipe.poll(PATIENCE):
                raise TimeoutError
            result = pipe.recv()
        except (EOFError, TimeoutError, ConnectionError) as error:
            process.kill()
            process.join()
            fault = "hangs" if isinstance(error, TimeoutError) else f"exit {process.exitcode}"
            story = mutated(seed, number).story
            result = {"outcomes": [], "fault": fault, "story": story}
            process = None
        results.append(result | {"number": number})
        if result["fault"]:
            print(f"file {number} ({result['story']}): {result['fault']}", flush=True)
    if process is not None and pipe is not None:
        pipe.send(None)
        process.join()
    return results


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    results = run(options.files, options.seed, options.first)
    measured = [result for result in results if "cpu_s" in result]
    for key, unit in (("cpu_s", "s"), ("mib", "MiB")):
        for result in sorted(measured, key=lambda r: -r[key])[:3]:
            print(f"{result[key]:8.3f} {unit}: file {result['number']} ({result['story']})")
    figures: dict[str, dict[str, float]] = {
        "files": {"n": len(results), "faults": sum(bool(r["fault"]) for r in results)},
        "outcomes": dict(sorted(Counter(o for r in results for o in r["outcomes"]).items())),
    }
    for key, name, limit in (("cpu_s", "cpu s", MAX_SECONDS), ("mib", "memory MiB", MAX_MIB)):
        values = np.array([result[key] for result in measured])
        figures[name] = {
            "p50": float(np.percentile(values, 50)),
            "p99": float(np.percentile(values, 99)),
            "max": float(values.max()),
            "over the limit": int((values > limit).sum()),
        }
    report(figures, options)


if __name__ == "__main__":
    main()
