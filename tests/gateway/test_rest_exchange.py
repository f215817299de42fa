"""Files that are made to do harm, sent to a real server: refused, ended, and nothing held up."""

import io
import zipfile
from pathlib import Path
from typing import Any

import pytest

from app.gateway import rest_exchange
from app.gateway.tokens import TokenStore
from app.gestures import NewGesture
from app.gestures.setwriter import zip_stream
from app.link.actions import Home
from tests.gateway import held
from tests.gateway.running import Running, wait_for
from tests.gestures.conftest import template

ZIP = {"Content-Type": "application/zip"}
IMPORT = "/api/galleries/shared/import"


def packed(index: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as file:
        file.writestr("gestures.toml", index)
    return out.getvalue()


def ended(server: Running, job: dict[str, Any]) -> dict[str, Any]:
    path = f"/api/jobs/{job['id']}"
    wait_for(lambda: server.http.get(path).json()["state"] != "running", "the job to end", 60)
    answer: dict[str, Any] = server.http.get(path).json()
    return answer


def start(server: Running, data: bytes) -> dict[str, Any]:
    answer = server.http.post(IMPORT, content=data, headers=ZIP)
    assert answer.status_code == 202, answer.text
    started: dict[str, Any] = answer.json()
    return started


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (packed(bytes(60 << 20), zipfile.ZIP_BZIP2), "packed with bzip2"),
        (packed(bytes(60 << 20)), "is larger than"),
        (packed(b"a." * 40_000 + b"a = 1"), "a key of more than 8 parts"),
        (packed(b"a = " + b"[" * 100_000), "nested deeper"),
    ],
    ids=["bzip2", "deflate", "key", "brackets"],
)
def test_a_bomb_is_refused_and_says_what_it_is(lasting: Running, data: bytes, message: str) -> None:
    told = ended(lasting, start(lasting, data))
    assert (told["state"], told["error"]["code"]) == ("failed", "invalid")
    assert message in told["error"]["message"]


def test_reading_that_goes_on_for_ever_is_cancelled_at_once(
    server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hold = tmp_path / "hold"
    hold.touch()
    monkeypatch.setenv("HELD_WHILE", str(hold))
    monkeypatch.setattr(rest_exchange, "read_zip", held.read_zip)
    jobs = [start(server, packed(b"format = 1")) for _ in range(2)]
    refused = server.http.post(IMPORT, content=b"x", headers=ZIP)
    assert refused.status_code == 429 and "retry-after" in refused.headers
    for job in jobs:
        server.http.delete(f"/api/jobs/{job['id']}")
    assert [ended(server, job)["state"] for job in jobs] == ["cancelled"] * 2
    assert hold.exists()
    # Both places are free.
    for job in [start(server, packed(b"format = 1")) for _ in range(2)]:
        server.http.delete(f"/api/jobs/{job['id']}")
        ended(server, job)


def test_reading_is_bounded_in_memory(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rest_exchange, "READ_BYTES", 64 << 20)
    monkeypatch.setattr(rest_exchange, "read_zip", held.take_for)
    told = ended(server, start(server, packed(b"format = 1")))
    assert (told["state"], told["error"]["code"]) == ("failed", "too_much_work")
    assert server.http.get("/api/health").status_code == 200


def test_an_import_writes_nothing_once_its_token_is_revoked(
    server: Running, folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hold = tmp_path / "hold"
    hold.touch()
    monkeypatch.setenv("HELD_WHILE", str(hold))
    monkeypatch.setattr(rest_exchange, "read_zip", held.read_zip)
    before = server.http.get("/api/gestures").json()
    tokens = TokenStore(folder / "data" / "tokens.json")
    made = tokens.make("operator", "guest")
    guest = {"Authorization": f"Bearer {made.secret}"}
    file = b"".join(zip_stream([NewGesture("new", Home(), (template(1),))]))
    job = server.http.post(IMPORT, content=file, headers={**ZIP, **guest}).json()
    tokens.revoke(made.token.id)
    wait_for(lambda: server.http.get("/api/gestures", headers=guest).status_code == 401)
    hold.unlink()
    told = ended(server, job)
    assert (told["state"], told["error"]["code"]) == ("failed", "not_signed_in")
    assert server.http.get("/api/gestures").json() == before
