import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.link.gateway_end import GatewayEnd
from app.link.node_end import NodeEnd
from app.link.session import socket_endpoint


@pytest.fixture
def endpoint() -> Iterator[str]:
    # Not tmp_path: a unix socket's path may have 100 bytes, and pytest's are long.
    folder = Path(tempfile.mkdtemp(prefix="fh-"))
    yield socket_endpoint(folder / "node.sock")
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def node(endpoint: str) -> Iterator[NodeEnd]:
    end = NodeEnd("puma", endpoint)
    yield end
    end.close()


@pytest.fixture
def gateway(node: NodeEnd, endpoint: str) -> Iterator[GatewayEnd]:
    end = GatewayEnd("puma", endpoint)
    yield end
    end.close()


def wait_for(condition: Callable[[], object], what: str, timeout: float = 120.0) -> None:
    """Return as soon as ``condition`` holds."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"did not happen within {timeout} s: {what}")
        time.sleep(0.002)
