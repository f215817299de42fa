"""What the gesture manager does, over REST: samples, undo, mix-ups, a gallery as a file."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.gateway import jobs, rest_matrix
from app.gateway.gallery import DATABASE_FILE
from app.gateway.undo_offer import HEADER
from app.gestures import NewGesture
from app.gestures.exchange import entries_of
from app.gestures.setwriter import zip_stream
from app.link.actions import Home
from tests.gateway import held
from tests.gateway.running import Running, wait_for
from tests.gateway.test_rest_gestures import JOG, enrol, error
from tests.gestures.conftest import template
from tests.small_gallery import fill_small

Hand = Callable[..., bytes]
ZIP = {"Content-Type": "application/zip"}


@pytest.fixture(scope="session")
def small_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four gestures with two samples each: these tests change them again and again."""
    path = tmp_path_factory.mktemp("manager") / DATABASE_FILE
    fill_small(path, "up", "down", "close", "home")
    return path


@pytest.fixture
def server(server: Running) -> Running:
    """The server, asked by somebody patient: no test here is about speed."""
    server.http.timeout = 90.0
    return server


def gestures(server: Running) -> dict[str, dict[str, Any]]:
    """By name."""
    return {gesture["name"]: gesture for gesture in server.http.get("/api/gestures").json()}


def zipped(index: str) -> bytes:
    """A zip file with nothing but an index."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("gestures.toml", index)
    return file.getvalue()


def seen(server: Running) -> list[Any]:
    """All but when and how often a gesture changed."""
    kept = [
        {**gesture, "updated": "", "version": 0}
        for gesture in server.http.get("/api/gestures").json()
    ]
    pictures = [
        server.http.get(f"/api/gestures/{one['id']}/template.png?sample={number}").content
        for one in kept[:3]
        for number in range(one["samples"])
    ]
    return [kept, pictures]


def undo(server: Running, answer: httpx.Response) -> httpx.Response:
    return server.http.post(f"/api/changes/{answer.headers[HEADER]}/undo")


def ended(server: Running, answer: httpx.Response) -> dict[str, Any]:
    assert answer.status_code == 202, answer.text
    path = f"/api/jobs/{answer.json()['id']}"

    def job() -> dict[str, Any] | None:
        told: dict[str, Any] = server.http.get(path).json()
        return None if told["state"] == "running" else told

    told: dict[str, Any] = wait_for(job, "the job to end", 60)
    return told


def result(server: Running, answer: httpx.Response) -> dict[str, Any]:
    job = ended(server, answer)
    assert job["state"] == "done", job
    found: dict[str, Any] = job["result"]
    return found


def test_a_sample_is_deleted_or_moved_and_brought_back(server: Running) -> None:
    api, before = server.http, seen(server)
    up, down = gestures(server)["up"], gestures(server)["down"]
    path = f"/api/gestures/{up['id']}/samples"
    first, second = up["sample_ids"]
    with server.operator() as operator:
        answer = api.delete(f"{path}/{first}")
        assert answer.json()["sample_ids"] == [second]
        operator.next("gallery")
    assert error(api.delete(f"{path}/{second}"), 409, "last_sample").startswith("it is the only")
    error(api.delete(f"{path}/{first}"), 404, "not_found")
    brought = undo(server, answer)
    assert [one["sample_ids"] for one in brought.json()] == [[first, second]]
    assert seen(server) == before
    answer = api.post(f"{path}/{second}/move", json={"to": down["id"]})
    both = answer.json()
    assert [one["name"] for one in both] == ["up", "down"]
    assert both[1]["sample_ids"] == [*down["sample_ids"], second]
    undo(server, answer)
    assert seen(server) == before
    for body in ({"to": 5}, {"to": up["id"]}, {}, {"too": "x"}):
        error(api.post(f"{path}/{second}/move", json=body), 422, "invalid")
    error(api.post(f"{path}/{second}/move", json={"to": "nobody"}), 404, "not_found")
    error(api.post(f"{path}/{second}/move", content=b"{}"), 415, "unsupported_media_type")
    assert seen(server) == before


def test_every_change_of_a_gesture_can_be_taken_back(server: Running, hand: Hand) -> None:
    api, before = server.http, seen(server)
    path = f"/api/gestures/{gestures(server)['up']['id']}"
    image = [("images", hand("left"))]
    for change in (
        lambda: api.patch(path, json={"name": "higher", "active": False, "action": JOG}),
        lambda: api.post(f"{path}/samples?replace=true", files=image),
        lambda: enrol(server, "wave", JOG, hand("left")),
        lambda: api.delete(path),
    ):
        answer = change()
        assert answer.is_success, answer.text
        after = seen(server)
        assert after != before
        back = undo(server, answer)
        assert back.status_code == 200, back.text
        assert seen(server) == before
    again = undo(server, back)
    assert seen(server) == after
    undo(server, again)
    assert seen(server) == before
    # A version that is taken back can be given up again, too.
    answer = api.post(f"{path}/versions/1/restore")
    undo(server, answer)
    assert seen(server) == before
    assert error(undo(server, answer), 404, "not_found").startswith("this cannot be taken back")


def test_a_later_change_is_not_overwritten_by_undo(server: Running) -> None:
    path = f"/api/gestures/{gestures(server)['up']['id']}"
    renamed = server.http.patch(path, json={"name": "higher"})
    server.http.patch(path, json={"active": False})
    message = error(undo(server, renamed), 409, "changed_meanwhile")
    assert message == "higher has been changed since; take the later change back first"
    # What changes nothing can be taken back as well, and nothing is offered for what failed.
    assert HEADER not in server.http.patch(path, json={"name": "down"}).headers


def test_two_alike_are_told_by_their_own_samples(server: Running) -> None:
    three = [template(number) for number in range(3)]
    for name in ("wave", "twin"):
        server.hub.store.create(name, Home(), three)
    retired = gestures(server)["home"]
    server.http.patch(f"/api/gestures/{retired['id']}", json={"active": False})
    single = gestures(server)["close"]
    server.http.delete(f"/api/gestures/{single['id']}/samples/{single['sample_ids'][0]}")
    found = result(server, server.http.post("/api/galleries/shared/matrix"))
    by_id = {one["id"]: one for one in found["gestures"]}
    assert retired["id"] not in by_id
    assert found["untested"] == [single["id"]]
    for one, counts, rejected in zip(
        found["gestures"], found["counts"], found["rejected"], strict=True
    ):
        assert sum(counts) + rejected == one["asked"]
        assert one["asked"] == (0 if one["id"] == single["id"] else one["samples"])
    worst = found["worst"]
    names = {by_id[worst[key]]["name"] for key in ("shown", "other")}
    assert names == {"wave", "twin"}
    assert worst["level"] in ("mistaken", "undecided")
    error(server.http.post("/api/galleries/nobody/matrix"), 404, "not_found")


def test_a_job_is_cancelled_and_too_many_are_refused(
    server: Running, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hold = tmp_path / "hold"
    hold.touch()
    monkeypatch.setenv("HELD_WHILE", str(hold))
    monkeypatch.setattr(rest_matrix, "try_all", held.try_all)
    start = lambda: server.http.post("/api/galleries/shared/matrix")  # noqa: E731
    try:
        first, second = start(), start()
        error(start(), 429, "busy")
        error(
            server.http.post("/api/galleries/shared/import", content=b"x", headers=ZIP), 429, "busy"
        )
        path = f"/api/jobs/{first.json()['id']}"
        wait_for(lambda: server.http.get(path).json()["total"], "the job to begin")
        assert server.http.delete(path).json()["state"] == "running"
        # It ends at once, although it says nothing, and its place is free.
        told = ended(server, first)
        assert (told["state"], told["kind"], told["result"]) == ("cancelled", "matrix", None)
        third = start()
        assert third.status_code == 202
        # Driving and everything else go on meanwhile.
        assert server.http.get("/api/health").status_code == 200
    finally:
        hold.unlink()
    assert ended(server, second)["state"] == "done"
    assert ended(server, third)["state"] == "done"
    error(server.http.get("/api/jobs/nobody"), 404, "not_found")
    error(server.http.delete("/api/jobs/nobody"), 404, "not_found")


def test_a_gallery_goes_out_as_a_file_and_comes_in_again(server: Running) -> None:
    api, before = server.http, seen(server)
    ann = api.post("/api/galleries", json={"name": "Änn & Co."}).json()["id"]
    answer = api.get(f"/api/galleries/{ann}/export")
    assert answer.headers["content-type"] == "application/zip"
    disposition = answer.headers["content-disposition"]
    assert disposition == 'attachment; filename="farhand-nn-co.zip"'
    assert error(api.get("/api/galleries/nobody/export"), 404, "not_found")
    path, file = "/api/galleries/shared/import", answer.content
    same = result(server, api.post(path, content=file, headers=ZIP))
    assert {one["fate"] for one in same["gestures"]} == {"same"}
    assert same["change"] is None
    assert seen(server) == before
    # Changed, deleted, and one that the file does not know.
    there = gestures(server)
    api.patch(f"/api/gestures/{there['up']['id']}", json={"action": JOG})
    api.delete(f"/api/gestures/{there['down']['id']}")
    server.hub.store.create("mine", Home(), [template(1)])
    changed = seen(server)
    for existing, fate in (("skip", "skipped"), ("replace", "replaced")):
        shown = result(
            server,
            api.post(path, params={"existing": existing, "check": True}, content=file, headers=ZIP),
        )
        fates = {one["name"]: one["fate"] for one in shown["gestures"]}
        assert (fates.pop("up"), fates.pop("down")) == (fate, "new")
        assert set(fates.values()) == {"same"}
        assert seen(server) == changed
    params = {"plan": shown["plan"]}
    with server.operator() as operator:
        done = result(server, api.post(path, params=params, content=file, headers=ZIP))
        operator.next("gallery")
    assert done["gestures"] == shown["gestures"]
    assert gestures(server)["up"]["action"] == there["up"]["action"]
    assert set(gestures(server)) == {*there, "mine"}
    assert api.post(f"/api/changes/{done['change']}/undo").status_code == 200
    assert seen(server) == changed
    # What was shown is not what would happen any more.
    api.delete(f"/api/gestures/{gestures(server)['up']['id']}")
    job = ended(server, api.post(path, params=params, content=file, headers=ZIP))
    assert (job["state"], job["error"]["code"]) == ("failed", "changed_meanwhile")


def test_a_bad_file_changes_nothing_and_says_what_is_wrong(server: Running) -> None:
    api, path, before = server.http, "/api/galleries/shared/import", seen(server)
    good = b"".join(zip_stream(entries_of(server.hub.store.list())))
    for body, words in (
        (b"", "neither a readable folder nor a readable zip file"),
        (b"hello", "neither a readable folder nor a readable zip file"),
        (good[:-30], "neither a readable folder nor a readable zip file"),
        (zipped("format = 9"), "gestures.toml has format 9; this Farhand reads formats 1 and 2"),
        (zipped('format = 1\n[[gesture]]\nname = "x"'), "gesture 1 (x): samples is missing"),
    ):
        job = ended(server, api.post(path, content=body, headers=ZIP))
        assert (job["state"], job["error"]["code"]) == ("failed", "invalid"), job
        assert words in job["error"]["message"]
    error(api.post(path, content=good), 415, "unsupported_media_type")
    error(api.post(path, params={"existing": "eat"}, content=good, headers=ZIP), 422, "invalid")
    error(api.post("/api/galleries/nobody/import", content=good, headers=ZIP), 404, "not_found")
    large = b"x" * (server.hub.settings.gateway.max_import_bytes + 70_000)
    error(api.post(path, content=large, headers=ZIP), 413, "too_large")
    assert seen(server) == before


@pytest.mark.parametrize(
    ("at", "where"), [(10, "reading"), (30, "learning"), (50, "writing")], ids=lambda it: str(it)
)
def test_an_import_that_is_cancelled_in_the_middle_changes_nothing(
    server: Running, monkeypatch: pytest.MonkeyPatch, at: int, where: str
) -> None:
    before = seen(server)
    many = [NewGesture(f"new {n}", Home(), (template(n),)) for n in range(20)]
    real = jobs.Job.progress

    def progress(job: jobs.Job, done: int, total: int) -> None:
        if job.kind == "import" and done == at:
            assert server.http.delete(f"/api/jobs/{job.id}").status_code == 200
        real(job, done, total)

    monkeypatch.setattr(jobs.Job, "progress", progress)
    file = b"".join(zip_stream(many))
    job = ended(server, server.http.post("/api/galleries/shared/import", content=file, headers=ZIP))
    assert (job["state"], job["total"], job["error"]) == ("cancelled", 60, None)
    assert at - 2 <= job["done"] < at, where
    assert seen(server) == before
