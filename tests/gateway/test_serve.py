"""Running the server as a program does."""

import asyncio
import contextlib
import getpass
import io
import os
import re
import shutil
import signal
import socket
import sqlite3
import ssl
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import msgspec
import psutil
import pytest
import viser
from pydantic import SecretStr, ValidationError
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from app.config import Settings
from app.errors import CannotStart
from app.gateway.greeting import address, greet, link
from app.gateway.serve import LOCK_FILE, bind, lock_data_folder
from app.gateway.tls import FOLDER, read_authority
from app.gateway.tokens import TokenStore
from app.gateway.transport import check_transport, keep_certificate, local_authority
from app.robot.latch_lock import lock_latch
from benchmarks.node_process import free_port
from benchmarks.scene_cost import CAMERA
from tests.gateway.browser import SignedIn
from tests.gateway.running import TOKEN, StandIn, running, settings_for, wait_for
from tests.unread import PipeReader

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
HTML = {"Accept": "text/html"}


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
                assert time.monotonic() - started < 15
        assert process.returncode == 0
        assert out == ""
        assert "Traceback" not in err
        assert token not in err


def test_it_serves_though_nobody_takes_its_link(folder: Path, node: StandIn) -> None:
    port = str(free_port())
    with PipeReader() as out:
        out.stop()
        command = [sys.executable, "-c", SCRIPT, "127.0.0.1", port, str(folder / "data")]
        process = subprocess.Popen(
            [*command, node.endpoint, "-", "-"],
            stdout=out.handle,
            stderr=subprocess.DEVNULL,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
                wait_for(lambda: reached(client), "the server", 60)
            out.go_on()
            wait_for(lambda: "?token=" in out.text, "the link")
            process.terminate()
            assert process.wait(30) == 0
        finally:
            process.kill()
            process.wait()
    assert re.fullmatch(r"http://\S+/\?token=\S+\n", out.text.lstrip("\n"))


def reached(client: httpx.Client) -> bool:
    try:
        return client.get("/api/health").status_code == 200
    except httpx.ConnectError:
        return False


def test_nothing_is_left_behind_when_it_ends(folder: Path) -> None:
    with program(folder / "data") as process:
        read_link(process)
        family = psutil.Process(process.pid).children(recursive=True)
        assert len(family) >= 2
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
        assert process.returncode == 0
        psutil.wait_procs(family, 20)
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
    assert [path.name for path in tmp_path.iterdir()] == [LOCK_FILE]


def test_a_data_folder_has_one_server(folder: Path, node: StandIn) -> None:
    """Refused while the first runs and while it is stopped; not once it was killed."""
    data = folder / "data"
    latch = data / "stop-puma.latch"
    latch.write_text('{"source": "anna", "reason": "somebody is in the cell"}')
    with program(data, node.endpoint) as first:
        read_link(first)
        for number in (None, signal.SIGSTOP):
            if number is not None:
                first.send_signal(number)
            with program(data, node.endpoint) as second:
                out, err = second.communicate(timeout=60)
            assert second.returncode == 1
            assert out == ""
            since = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[+-]\d\d:\d\d"
            assert re.fullmatch(
                rf"farhand: the data folder {data} is in use by process {first.pid} since {since}; "
                "end that server first, or choose another folder with --data-dir\n",
                err,
            )
        # What is made to work beside a server does.
        TokenStore.from_settings(settings_for(folder, "-")).make("observer", "", None)
        first.kill()
        first.wait()
    assert latch.is_file()
    with program(data, node.endpoint) as third:
        read_link(third)


def test_a_data_folder_is_closed_to_other_users(folder: Path) -> None:
    data = folder / "data"
    data.chmod(0o755)
    (data / "gestures.db").chmod(0o644)
    with program(data) as process:
        read_link(process)
        made = {path.name for path in data.iterdir()}
        assert made >= {"gestures.db", "memory.db", "tokens.json", "stop-puma.latch.lock"}
        for path in [data, *data.rglob("*")]:
            assert path.stat().st_mode & 0o077 == 0, path
        # Its node's latch is nobody else's either.
        with pytest.raises(CannotStart, match=f"in use by process {process.pid} since"):
            lock_latch(data / "stop-puma.latch")


def test_a_data_folder_of_another_kind_is_one_clear_line(tmp_path: Path) -> None:
    tmp_path.chmod(0o1777)
    with pytest.raises(CannotStart, match="all users share"):
        lock_data_folder(tmp_path)


def test_a_database_of_something_else_is_one_clear_line(tmp_path: Path) -> None:
    with contextlib.closing(sqlite3.connect(tmp_path / "gestures.db")) as other:
        other.execute("CREATE TABLE customers (id INTEGER)")
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


def test_off_loopback_a_certificate_is_made(folder: Path, node: StandIn) -> None:
    data = folder / "data"
    with program(data, node.endpoint, host="0.0.0.0") as process:
        url, token = read_link(process)
        assert url.startswith("https://")
        port = url.rpartition(":")[2]
        authority = read_authority(data / FOLDER)
        assert authority is not None
        trust = ssl.create_default_context(cadata=authority.pem.decode())
        with httpx.Client(verify=trust, trust_env=False) as client:
            for host in ("localhost", "127.0.0.1"):
                answer = client.get(f"https://{host}:{port}/", params={"token": token})
                assert answer.status_code == 303
                assert answer.headers["set-cookie"].startswith("__Host-farhand_")
            # Everybody may know whom to trust.
            page = client.get(f"https://localhost:{port}/trust")
            assert authority.fingerprint in page.text
            assert client.get(f"https://localhost:{port}/trust/ca.pem").content == authority.pem
            assert client.get(f"https://localhost:{port}/trust/ca.crt").content == authority.der
            foreign = client.get(f"https://localhost:{port}/api/health", headers={"Host": "evil"})
            assert foreign.status_code == 400
            # Who forgets the "https://" is told, and nothing said in the clear is used.
            plain = client.get(f"http://127.0.0.1:{port}/", params={"token": token})
            assert plain.status_code == 400
            assert f"https://127.0.0.1:{port}/" in plain.text
            assert token not in plain.text
            assert "set-cookie" not in plain.headers
    # The next start uses the same.
    assert read_authority(data / FOLDER) == authority


def test_the_server_and_all_it_starts_listen_on_one_port(folder: Path) -> None:
    """Node, camera process and 3D view listen on files alone, in folders that are ours alone.

    And none of them outlives the server, even if that is killed.
    """
    with program(folder / "data", host="0.0.0.0") as process:
        url, token = read_link(process)
        port = int(url.rpartition(":")[2])
        bearer = {"Authorization": f"Bearer {token}"}
        authority = read_authority(folder / "data" / FOLDER)
        assert authority is not None
        trust = ssl.create_default_context(cadata=authority.pem.decode())
        with httpx.Client(headers=bearer, verify=trust, trust_env=False, timeout=60) as client:
            here = f"https://localhost:{port}"
            # All parts are up: the node with its cameras, and the 3D view.
            for path in ("api/cameras/wrist.jpg", "viser/"):
                wait_for(
                    lambda path=path: client.get(f"{here}/{path}").status_code == 200, path, 60
                )
            protocol = [Subprotocol(f"viser-v{viser.__version__}")]
            with connect(
                f"wss://localhost:{port}/viser",
                ssl=trust,
                additional_headers=bearer,
                subprotocols=protocol,
                proxy=None,
                max_size=None,
            ) as look:
                look.send(msgspec.msgpack.encode(CAMERA))
                assert look.recv(timeout=20)
                family = [psutil.Process(process.pid)]
                family += family[0].children(recursive=True)
                assert len(family) >= 3
                ports = [
                    connection.laddr
                    for each in family
                    for connection in each.net_connections(kind="inet")
                    if connection.status == psutil.CONN_LISTEN
                    or connection.type == socket.SOCK_DGRAM
                ]
                files = {
                    Path(connection.laddr)
                    for each in family
                    for connection in each.net_connections(kind="unix")
                    if connection.laddr
                }
        assert [(address.ip, address.port) for address in ports] == [("0.0.0.0", port)]
        assert {path.name for path in files} == {"link", "viser"}
        for path in files:
            assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
            assert path.parent.owner() == getpass.getuser()
        process.kill()
        _, alive = psutil.wait_procs(family, timeout=30)
        assert not alive
        for path in files:  # a kill leaves them behind
            shutil.rmtree(path.parent)


def test_a_certificate_is_made_only_where_none_is_given(tmp_path: Path) -> None:
    cert = tmp_path / "a"
    for settings in (
        Settings(host="127.0.0.1", data_dir=tmp_path),
        Settings(host="0.0.0.0", data_dir=tmp_path, behind_proxy=True),
        Settings(host="0.0.0.0", data_dir=tmp_path, tls_cert=cert, tls_key=cert),
    ):
        assert local_authority(settings) is None
    assert list(tmp_path.iterdir()) == []
    settings = Settings(
        host="0.0.0.0", data_dir=tmp_path, gateway={"allowed_hosts": ["arm.example"]}
    )
    authority = local_authority(settings)
    assert authority is not None
    assert "arm.example" in authority.names.dns


def test_settings_of_a_proxy_need_one() -> None:
    with pytest.raises(CannotStart, match="give --behind-proxy, too"):
        check_transport(Settings(root_path="/farhand"))
    for path in ("/api", "/static/farhand"):
        with pytest.raises(CannotStart, match="which Farhand uses itself"):
            check_transport(Settings(root_path=path, behind_proxy=True))
    check_transport(Settings(root_path="/arms/farhand", behind_proxy=True))
    for path in ("farhand", "/farhand/", "/", "/a b", "/a?b", "//evil.example"):
        with pytest.raises(ValidationError):
            Settings(root_path=path)


async def test_a_given_certificate_that_changes_is_read_again(
    certificate: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cert, key = (Path(shutil.copy(path, tmp_path)) for path in certificate)
    monkeypatch.setattr("app.gateway.transport.CERTIFICATE_CHECK_S", 0.01)
    loaded = []

    class Context(ssl.SSLContext):
        def load_cert_chain(self, *files: Path) -> None:  # type: ignore[override]
            super().load_cert_chain(*files)
            loaded.append(files)

    context = Context(ssl.PROTOCOL_TLS_SERVER)
    settings = Settings(tls_cert=cert, tls_key=key)
    keeping = asyncio.create_task(keep_certificate(context, settings, None))
    try:
        await asyncio.sleep(0)
        os.utime(cert, ns=(1, 1))
        while not loaded:
            await asyncio.sleep(0.01)
        # What is broken changes nothing, and is tried again when it changes again.
        text = key.read_text()
        key.write_text("nonsense")
        os.utime(key, ns=(2, 2))
        await asyncio.sleep(0.05)
        assert not keeping.done()
        count = len(loaded)
        key.write_text(text)
        while len(loaded) == count:
            await asyncio.sleep(0.01)
        assert loaded[-1] == (cert, key)
    finally:
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)


@pytest.mark.parametrize("cut", [False, True])
def test_everything_works_below_a_path(folder: Path, node: StandIn, cut: bool) -> None:
    """Proxies that pass the prefix on, and proxies that cut it off."""
    settings = settings_for(folder, node.endpoint).model_copy(
        update={"root_path": "/arms/one", "behind_proxy": True}
    )
    sent = "" if cut else "/arms/one"
    with running(settings) as server:
        http = server.http
        assert http.get(f"{sent}/api/health").json()["robots"]
        page = http.get(f"{sent}/")
        assert page.status_code == 200
        assert http.get(f"{sent}/static/app.js").status_code == 200
        assert http.get(f"{sent}/static/media/operator.json").status_code == 200
        # Nothing in the page begins at the root of the host.
        assert not re.search(r"""(src|href|action)=["']/""", page.text)
        assert http.get(f"{sent}/viser").headers["location"] == "/arms/one/viser/"
        with httpx.Client(base_url=server.url, headers=HTML, trust_env=False) as client:
            signed_out = client.get(f"{sent}/")
            assert 'action="/arms/one/signin"' in signed_out.text
            assert 'href="/arms/one/trust"' in signed_out.text
            answer = client.get(f"{sent}/", params={"token": TOKEN})
            page = SignedIn.by(answer)
            assert answer.headers["location"].partition("#")[0] == "/arms/one/"
            assert "; Path=/;" in answer.headers["set-cookie"]
        origin = f"https://{server.host}"
        with server.socket(f"{sent}/ws/operator", **page.socket(), origin=origin):
            pass
        if not cut:
            moved = http.get("/arms/one")
            assert (moved.status_code, moved.headers["location"]) == (308, "/arms/one/")
        assert http.get("/arms/two/api/health").status_code == 404
        assert "/arms/one" not in http.get(f"{sent}/api/nothing").json()["error"]["message"]


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
    assert link(address(Settings(), 8000, None), "t") == "http://127.0.0.1:8000/?token=t"
    assert address(Settings(host="::1"), 8000, None) == "http://[::1]:8000/"
    assert "0.0.0.0" not in address(Settings(host="0.0.0.0"), 8000, None)
    below = Settings(root_path="/arm", behind_proxy=True)
    assert address(below, 8000, None) == "http://127.0.0.1:8000/arm/"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_codes_and_a_link_to_watch(tmp_path: Path) -> None:
    settings = Settings(host="0.0.0.0", data_dir=tmp_path)
    authority = local_authority(settings)
    assert authority is not None
    tokens = TokenStore.from_settings(settings)
    out = Terminal()
    greet(settings, 8000, tokens, authority, out)
    text = out.getvalue()
    secrets = list(dict.fromkeys(re.findall(r"token=(\S+)", text)))
    found = [tokens.by_secret(secret) for secret in secrets]
    assert [token and token.role for token in found] == ["operator", "observer"]
    assert all(token and token.expires for token in found)
    assert "█" in text or "▄" in text
    assert authority.public.fingerprint in text
    # The first line is the one that programs read.
    assert re.fullmatch(r"https://\S+:8000/\?token=\S+", text.splitlines()[0])


def test_without_a_terminal_it_is_one_line_and_a_restart_signs_nobody_out(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    tokens = TokenStore.from_settings(settings)
    secrets = []
    for _ in range(6):
        out = io.StringIO()
        greet(settings, 8000, tokens, None, out)
        assert out.getvalue().count("\n") == 1
        secrets.append(out.getvalue().strip().rpartition("token=")[2])
    assert tokens.by_secret(secrets[0]) is None
    assert all(tokens.by_secret(secret) for secret in secrets[1:])
    # A token that was given is printed, and none is made.
    given = settings.model_copy(update={"token": SecretStr("T" * 32)})
    out = io.StringIO()
    greet(given, 8000, TokenStore.from_settings(given), None, out)
    assert out.getvalue() == f"http://127.0.0.1:8000/?token={'T' * 32}\n"
    assert len(tokens.list()) == 5
