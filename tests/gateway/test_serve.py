"""Running the server as a program does."""

import os
import re
import signal
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import psutil
import pytest

from app.config import Settings
from app.errors import CannotStart
from app.gateway.serve import bind, check_transport, link
from tests.gateway.running import StandIn, wait_for

SCRIPT = """
import sys
from pathlib import Path
from app.config import GatewaySettings, RobotSettings, Settings
from app.errors import FarhandError
from app.gateway.serve import serve
host, port, folder, endpoint, cert, key = sys.argv[1:]
robot = RobotSettings() if endpoint == "-" else RobotSettings(spawn=False, endpoint=endpoint)
try:
    serve(Settings(
        host=host, port=int(port), data_dir=Path(folder), robot=robot,
        tls_cert=None if cert == "-" else Path(cert), tls_key=None if key == "-" else Path(key),
        gateway=GatewaySettings(viser=endpoint == "-"),
    ))
except FarhandError as error:
    print(f"farhand: {error.message}", file=sys.stderr)
    sys.exit(1)
"""
ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.timeout(180)


@contextmanager
def program(
    folder: Path,
    endpoint: str = "-",
    *,
    port: int = 0,
    host: str = "127.0.0.1",
    cert: str = "-",
    key: str = "-",
) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, host, str(port), str(folder), endpoint, cert, key],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def read_link(process: subprocess.Popen[str]) -> tuple[str, str]:
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.fullmatch(r"(https?://\S+:\d+)/\?token=(\S+)\n", line)
    assert found is not None, line
    return found[1], found[2]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_prints_one_link_and_ends_quickly(
    folder: Path, node: StandIn, number: signal.Signals
) -> None:
    with program(folder / "data", node.endpoint) as process:
        url, token = read_link(process)
        bearer = {"Authorization": f"Bearer {token}"}
        with httpx.Client(base_url=url, headers=bearer, trust_env=False) as client:
            assert client.get("/api/health").json()["robots"][0]["online"] is True
            # An endless answer does not delay the end.
            with client.stream("GET", "/api/cameras/wrist.mjpeg") as endless:
                assert endless.status_code == 200
                started = time.monotonic()
                process.send_signal(number)
                out, err = process.communicate(timeout=30)
                assert time.monotonic() - started < 6
        assert process.returncode == 0
        assert out == ""
        assert "Traceback" not in err
        assert token not in err


def test_nothing_is_left_behind_when_it_ends(folder: Path) -> None:
    with program(folder / "data") as process:
        read_link(process)
        family = psutil.Process(process.pid).children(recursive=True)
        assert len(family) >= 2
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
        assert process.returncode == 0
        psutil.wait_procs(family, 5)
        assert [child for child in family if child.is_running()] == []


def test_the_node_ends_when_the_gateway_is_killed(folder: Path) -> None:
    with program(folder / "data") as process:
        read_link(process)
        family = psutil.Process(process.pid).children(recursive=True)
        process.kill()
        wait_for(lambda: not any(child.is_running() for child in family), "all to end", 15)


def test_a_busy_port_is_one_clear_line(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with program(tmp_path, port=port) as process:
            out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert out == ""
    assert err == (
        f"farhand: port {port} on 127.0.0.1 is taken by another program; "
        "end it, or choose another with --port (0 picks a free one)\n"
    )
    # Nothing was begun: not even the token.
    assert list(tmp_path.iterdir()) == []


def test_a_broken_database_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "gestures.db").write_bytes(b"not a database at all" * 500)
    with program(tmp_path, "unixsock-stream//nonexistent/link") as process:
        out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert out == ""
    assert "Traceback" not in err
    assert "gestures.db" in err.splitlines()[-1]


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    folder = tmp_path_factory.mktemp("tls")
    cert, key = folder / "cert.pem", folder / "key.pem"
    try:
        subprocess.run(
            [
                "openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
                "-keyout", str(key), "-out", str(cert),
            ],
            check=True,
            capture_output=True,
        )  # fmt: skip
    except FileNotFoundError:
        pytest.skip("no openssl program to make a certificate with")
    return str(cert), str(key)


def test_https(folder: Path, node: StandIn, certificate: tuple[str, str]) -> None:
    cert, key = certificate
    with program(folder / "data", node.endpoint, cert=cert, key=key) as process:
        url, token = read_link(process)
        assert url.startswith("https://127.0.0.1:")
        trust = ssl.create_default_context(cafile=cert)
        with httpx.Client(verify=trust, trust_env=False) as client:
            answer = client.get(f"{url}/", params={"token": token})
            assert answer.status_code == 303
            assert "Secure" in answer.headers["set-cookie"]


def test_off_loopback_plain_http_is_refused() -> None:
    with pytest.raises(CannotStart, match="give --tls-cert and --tls-key, or --behind-proxy"):
        check_transport(Settings(host="0.0.0.0"))
    check_transport(Settings(host="0.0.0.0", behind_proxy=True))
    check_transport(Settings(host="127.0.0.1"))
    check_transport(Settings(host="localhost"))


def test_half_or_broken_certificates_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="needs both"):
        check_transport(Settings(tls_cert=tmp_path / "a"))
    with pytest.raises(CannotStart, match="cannot be used"):
        check_transport(Settings(tls_cert=tmp_path / "a", tls_key=tmp_path / "b"))
    for name in "ab":
        (tmp_path / name).write_text("nonsense")
    with pytest.raises(CannotStart, match="cannot be used"):
        check_transport(Settings(tls_cert=tmp_path / "a", tls_key=tmp_path / "b"))


def test_addresses_that_cannot_be_had_are_clear() -> None:
    with pytest.raises(CannotStart, match="is not an address of this machine"):
        bind(Settings(host="192.0.2.1", port=0))
    with pytest.raises(CannotStart, match="is not known"):
        bind(Settings(host="no such host", port=0))


def test_links() -> None:
    assert link(Settings(), 8000, "t") == "http://127.0.0.1:8000/?token=t"
    assert link(Settings(host="::1"), 8000, "t") == "http://[::1]:8000/?token=t"
    assert "0.0.0.0" not in link(Settings(host="0.0.0.0"), 8000, "t")
