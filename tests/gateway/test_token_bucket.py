"""Token buckets on a virtual clock."""

from app.gateway import token_bucket
from app.gateway.token_bucket import RequestBuckets, TokenBucket


def test_a_burst_and_then_a_rate() -> None:
    bucket = TokenBucket(rate=2.0, burst=3.0)
    assert [bucket.take(0.0) for _ in range(4)] == [True, True, True, False]
    assert bucket.wait_s(0.0) == 0.5
    assert [bucket.take(0.5), bucket.take(0.5)] == [True, False]
    bucket.put_back()
    assert bucket.take(0.5)
    assert [bucket.take(100.0) for _ in range(4)] == [True, True, True, False]


def test_an_address_that_asks_too_much_takes_nothing_from_others() -> None:
    buckets = RequestBuckets(each=1.0, together=4.0, burst_s=2.0)
    assert [buckets.take("a", 0.0) for _ in range(100)] == [True] * 2 + [False] * 98
    assert [buckets.take("b", 0.0), buckets.take("c", 0.0)] == [True, True]


def test_all_together_have_a_rate_and_who_signs_in_is_not_counted() -> None:
    buckets = RequestBuckets(each=1.0, together=2.0, burst_s=2.0)
    assert [buckets.take(name, 0.0) for name in "abcde"] == [True] * 4 + [False]
    buckets.put_back("a")
    assert buckets.take("e", 0.0)
    # What all together refused cost the address nothing.
    assert not buckets.take("f", 0.0)
    assert [buckets.take("f", 1.0), buckets.take("f", 1.0)] == [True, True]


def test_addresses_are_forgotten() -> None:
    buckets = RequestBuckets(each=1.0, together=1e9, burst_s=1.0)
    for number in range(token_bucket.MAX_KEPT + 10):
        buckets.take(str(number), 0.0)
    assert len(buckets._own) == token_bucket.MAX_KEPT
