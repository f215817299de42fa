"""Behind a real nginx, with the configuration that docs/deploy.md gives."""

import os
import re
import shutil
import socket
import ssl
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import numpy as np
import pytest
import simplejpeg
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from app.gateway.machine import Names
from app.gateway.tls import SERVER_FILE, LocalAuthority
from tests.gateway.browser import SignedIn
from tests.gateway.conftest import draw
from tests.gateway.running import TOKEN, Operator, StandIn, running, settings_for, wait_for

DEPLOY = Path(__file__).parents[2] / "docs" / "deploy.md"
NAME = "arm.example.org"
NGINX = shutil.which("nginx", path=f"{os.environ['PATH']}:/usr/sbin")

pytestmark = pytest.mark.skipif(
    NGINX is None and "FARHAND_REQUIRE_BROWSER" not in os.environ,
    reason="no nginx on this machine (Debian: apt-get install nginx-light)",
)


def configuration(folder: Path, port: int, upstream: int, location: str, target: str) -> str:
    """The one from docs/deploy.md, with the values of this test."""
    block = re.search(r"```nginx\n(server \{.*?)```", DEPLOY.read_text(), re.DOTALL)
    assert block is not None
    text = block[1]
    for theirs, ours in {
        "listen 443 ssl": f"listen 127.0.0.1:{port} ssl",
        f"/etc/letsencrypt/live/{NAME}/fullchain.pem": f"{folder}/{SERVER_FILE}",
        f"/etc/letsencrypt/live/{NAME}/privkey.pem": f"{folder}/{SERVER_FILE}",
        "location / {": f"location {location} {{",
        "http://127.0.0.1:8000": f"http://127.0.0.1:{upstream}{target}",
    }.items():
        assert theirs in text, theirs
        text = text.replace(theirs, ours)
    temporary = "".join(
        f"{kind}_temp_path {folder}/{kind};\n"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    return (
        f"daemon off; master_process off; pid {folder}/pid; error_log {folder}/log;\n"
        f"events {{}}\nhttp {{\naccess_log off;\n{temporary}{text}}}\n"
    )


@contextmanager
def nginx(folder: Path, upstream: int, location: str, target: str) -> Iterator[int]:
    """Run it; gives the port that it listens on."""
    assert NGINX is not None, "no nginx on this machine (Debian: apt-get install nginx-light)"
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    path = folder / "nginx.conf"
    path.write_text(configuration(folder, port, upstream, location, target))
    process = subprocess.Popen([NGINX, "-p", folder, "-c", path, "-e", folder / "log"])

    def answers() -> bool:
        assert process.poll() is None, (folder / "log").read_text()
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    try:
        wait_for(answers, "nginx to listen")
        yield port
    finally:
        process.terminate()
        process.wait(20)


@pytest.mark.parametrize(
    ("prefix", "target"), [("", ""), ("/arms/one", ""), ("/arms/one", "/")], ids=str
)
def test_signing_in_driving_and_stopping_through_nginx(
    folder: Path, node: StandIn, prefix: str, target: str
) -> None:
    settings = settings_for(folder, node.endpoint, allowed_hosts=(NAME,)).model_copy(
        update={"root_path": prefix, "behind_proxy": True}
    )
    authority = LocalAuthority(folder, lambda: Names(dns=(NAME,), addresses=()))
    authority.prepare()
    trust = ssl.create_default_context(cadata=authority.public.pem.decode())
    with running(settings) as server, nginx(folder, server.port, f"{prefix}/", target) as port:
        host = f"{NAME}:{port}"
        own = Origin(f"https://{host}")
        link = httpx.Client(
            transport=httpx.HTTPTransport(verify=trust),
            base_url=f"https://127.0.0.1:{port}{prefix}",
            headers={"Host": host, "Accept": "text/html"},
            timeout=120,  # the first picture waits for a process to start
        )
        link.event_hooks["request"].append(
            lambda request: request.extensions.update(sni_hostname=NAME)
        )

        def open_socket(path: str, origin: Origin = own) -> ClientConnection:
            return connect(
                f"wss://{host}{prefix}{path}",
                sock=socket.create_connection(("127.0.0.1", port)),
                ssl=trust,
                origin=origin,
                **page.socket(),
                max_size=None,
            )

        with link:
            signed_in = link.get("/", params={"token": TOKEN})
            page = SignedIn.by(signed_in)
            assert signed_in.headers["location"].partition("#")[0] == f"{prefix}/"
            assert page.cookie.startswith("__Host-")
            assert "; Secure" in signed_in.headers["set-cookie"]
            headers = {**page.headers(), "Origin": own}
            shown = link.get("/", headers=headers)
            assert 'src="static/app.js"' in shown.text
            assert link.get("/static/app.js", headers=headers).status_code == 200

            # More than nginx lets through by itself: the answer is ours.
            noise = np.random.default_rng(0).integers(0, 255, (1000, 1600, 3), np.uint8)
            image = simplejpeg.encode_jpeg(noise, quality=95)
            assert len(image) > 1_500_000
            headers["Content-Type"] = "image/jpeg"
            answer = link.post("/api/recognise", content=image, headers=headers)
            assert answer.headers["content-type"] == "application/json"
            assert answer.status_code in (200, 413, 422)

        with Operator(open_socket("/ws/operator")) as operator:
            assert operator.show(draw("left"))["type"] == "frame"
            operator.send("stop")
            operator.next("robot", mode="stopped")
        assert node.stops
        with pytest.raises(InvalidStatus) as refused:
            open_socket("/ws/operator", origin=Origin("https://elsewhere.example"))
        assert refused.value.response.status_code == 403
