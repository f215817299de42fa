import tracemalloc
from collections import Counter

import cv2
import numpy as np
import pytest

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.pipeline import extract_template
from app.pipeline.reading import read_image
from benchmarks.fuzz_images import Subject
from benchmarks.mutated_images import mutated
from tests.pipeline.drawing import encoded

FILES = 500


@pytest.fixture(scope="module")
def outcomes():
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    subject, counts = Subject(), Counter()
    for number in range(FILES):
        data, story = mutated(7, number, large=False)
        try:
            counts.update(subject.try_file(data))
        except Exception as error:
            pytest.fail(f"file {number} ({story}): {type(error).__name__}: {error}")
    cv2.setNumThreads(threads)
    return counts


def test_every_file_gets_an_answer_or_a_refusal(outcomes):
    assert outcomes.total() >= 2 * FILES


def test_answers_and_refusals_both_occur(outcomes):
    kinds = {"photo: answer", "photo: ImageRefused", "frame: answer", "frame: FrameRefused"}
    assert kinds <= set(outcomes)
    assert min(outcomes[kind] for kind in kinds) > 20


def test_same_seed_same_files():
    assert mutated(7, 3) == mutated(7, 3)
    assert mutated(7, 3) != mutated(7, 4)


def test_something_else_than_a_refusal_is_noticed(monkeypatch):
    subject = Subject()
    data = next(m.data for m in (mutated(7, n) for n in range(20)) if m.data)

    def refuse(*args, **kw):
        raise ImageRefused("two lines\nof text that no one line can show")

    monkeypatch.setattr("benchmarks.fuzz_images.extract_template", refuse)
    with pytest.raises(AssertionError, match="two lines"):
        subject.try_file(data)
    monkeypatch.setattr("benchmarks.fuzz_images.extract_template", extract_template)
    subject.try_file(data)


def test_large_picture_with_transparency_takes_little_memory():
    data = encoded(np.full((2000, 2000, 4), 65535, np.uint16))
    tracemalloc.start()
    read_image(data, PipelineSettings())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # A pixel has eight bytes as decoded and three in the end; another copy would be too much.
    assert peak < 17 * 2000 * 2000
