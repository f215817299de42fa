"""Bad messages in a row, counted and told."""

import pytest

from app.errors import FarhandError, FrameRefused, RequestError
from app.gateway.bad_messages import BadMessages
from app.gateway.closing import CLOSE_BAD, Closing
from app.gateway.metrics import Metrics

Told = list[tuple[FarhandError, int | None]]


@pytest.fixture
def told() -> Told:
    return []


@pytest.fixture
def counted(told: Told) -> BadMessages:
    return BadMessages(3, Metrics(), lambda error, seq: told.append((error, seq)))


def wrong() -> RequestError:
    return RequestError("wrong")


def test_each_is_told_with_the_number_of_its_frame(counted: BadMessages, told: Told) -> None:
    error = FrameRefused("no JPEG", seq=7, bytes=3)
    counted.bad(error, 7, 1)
    assert told == [(error, 7)]
    # The number stands beside the detail, not in it.
    assert error.detail == {"bytes": 3}


def test_so_many_in_a_row_end_the_session_and_the_last_is_told_too(
    counted: BadMessages, told: Told
) -> None:
    counted.bad(wrong(), None, 1)
    counted.bad(wrong(), None, 2)
    with pytest.raises(Closing, match="3 bad messages in a row") as closing:
        counted.bad(wrong(), None, 3)
    assert closing.value.code == CLOSE_BAD
    assert len(told) == 3


def test_a_good_one_forgives_what_came_before_it(counted: BadMessages) -> None:
    for arrival in (1, 2, 4, 5):
        counted.bad(wrong(), None, arrival)
        if arrival == 2:
            counted.good(3)
    with pytest.raises(Closing):
        counted.bad(wrong(), None, 6)


def test_a_good_one_that_a_bad_one_overtook_forgives_nothing(counted: BadMessages) -> None:
    # A frame is judged later than the texts that came after it.
    counted.bad(wrong(), None, 1)
    counted.bad(wrong(), None, 3)
    counted.good(2)
    with pytest.raises(Closing):
        counted.bad(wrong(), None, 4)


def test_what_is_refused_is_counted_by_code() -> None:
    metrics = Metrics()
    counted = BadMessages(9, metrics, lambda error, seq: None)
    counted.bad(FrameRefused("no JPEG", code="frame_not_jpeg"), 1, 1)
    counted.bad(RequestError("what?", code="message_type"), None, 2)
    text = metrics.text().decode()
    assert 'farhand_bad_messages_total{code="frame_not_jpeg"} 1.0' in text
    assert 'farhand_bad_messages_total{code="message_type"} 1.0' in text
    assert 'farhand_frames_total{outcome="refused"} 1.0' in text
