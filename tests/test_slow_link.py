import contextlib
import socket
import time

import pytest

from tests.slow_link import SlowLink
from tests.test_proxy import connected, echo

__all__ = ["echo"]


def test_both_ways_are_delayed(echo: int) -> None:
    with SlowLink(echo, delay_s=0.1, rate=1e6) as link, connected(link) as client:
        began = time.monotonic()
        client.sendall(b"hello")
        assert client.recv(100) == b"hello"
        assert time.monotonic() - began >= 0.2
        client.shutdown(socket.SHUT_WR)
        assert client.recv(100) == b""


def test_the_rate_is_kept_and_nothing_is_lost_or_out_of_order(echo: int) -> None:
    sent = b"".join(b"%05d" % number for number in range(20_000))
    with SlowLink(echo, delay_s=0.0, rate=200_000) as link, connected(link) as client:
        began = time.monotonic()
        client.setblocking(False)
        accepted = 0
        got = b""
        while len(got) < len(sent):
            with contextlib.suppress(BlockingIOError):
                accepted += client.send(sent[accepted:])
            try:
                got += client.recv(1 << 16)
            except BlockingIOError:
                time.sleep(0.002)
        assert time.monotonic() - began >= 0.5
        assert got == sent
        assert link.carried == (len(sent), len(sent))


def test_a_sender_feels_that_the_link_is_slow(echo: int) -> None:
    with SlowLink(echo, delay_s=0.0, rate=1000) as link, connected(link) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16 * 1024)
        client.settimeout(0.5)
        with pytest.raises(TimeoutError):
            client.sendall(bytes(2_000_000))


def test_a_cut_link_carries_nothing_until_it_is_restored(echo: int) -> None:
    with SlowLink(echo, delay_s=0.0, rate=1e6) as link, connected(link) as client:
        client.sendall(b"0")
        assert client.recv(100) == b"0"
        link.hold()
        client.sendall(b"1")
        client.settimeout(0.2)
        with pytest.raises(TimeoutError):
            client.recv(100)
        client.settimeout(10)
        link.forward()
        assert client.recv(100) == b"1"
