import socket
import threading
from collections.abc import Iterator

import pytest

from tests.proxy import Proxy


@pytest.fixture
def echo() -> Iterator[int]:
    """The port of a server that says back what it hears, one connection after the other."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            with connection:
                while data := connection.recv(1 << 16):
                    connection.sendall(data)

    thread = threading.Thread(target=serve)
    thread.start()
    yield listener.getsockname()[1]
    listener.shutdown(socket.SHUT_RDWR)
    listener.close()
    thread.join()


def connected(proxy: Proxy) -> socket.socket:
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=10)


def test_it_forwards_both_ways_and_the_end(echo: int) -> None:
    with Proxy(echo) as proxy, connected(proxy) as client:
        client.sendall(b"hello")
        assert client.recv(100) == b"hello"
        client.shutdown(socket.SHUT_WR)
        assert client.recv(100) == b""


@pytest.mark.parametrize("way", [{"up": True, "down": False}, {"up": False, "down": True}, {}])
def test_what_is_held_comes_at_once_in_order_and_nothing_is_closed(
    echo: int, way: dict[str, bool]
) -> None:
    with Proxy(echo) as proxy, connected(proxy) as client:
        client.sendall(b"0")
        assert client.recv(100) == b"0"
        proxy.hold(**way)
        sent = b"".join(b"%04d" % number for number in range(50_000))
        client.sendall(sent)  # more than the sockets' buffers: the sender must not block
        client.settimeout(0.2)
        with pytest.raises(TimeoutError):
            client.recv(100)
        client.settimeout(10)
        proxy.forward()
        got = b""
        while len(got) < len(sent):
            got += client.recv(1 << 16)
        assert got == sent


def test_it_ends_its_connections_when_closed(echo: int) -> None:
    proxy = Proxy(echo)
    with connected(proxy) as client:
        client.sendall(b"1")
        assert client.recv(100) == b"1"
        proxy.hold()
        proxy.close()
        assert client.recv(100) == b""


def test_a_server_that_is_gone_closes_the_connection(echo: int) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port = nobody.getsockname()[1]
    with Proxy(port) as proxy, connected(proxy) as client:
        assert client.recv(100) == b""
