"""The command line, run as its users run it."""

import json
import os
import re
import subprocess
import sys
import zipfile
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import cv2
import httpx
import numpy as np
import pytest

from app.cli import main
from app.gateway.machine import machine_names
from app.gateway.tls import LocalAuthority
from app.gestures import GestureStore, backup
from app.gestures.backup import Place
from app.gestures.hand import POSES, HandLook, HandView, render_hand, render_sprite
from app.gestures.hand.render import compose
from app.gestures.synthetic import Step, SyntheticOperator, write_mjpeg
from tests.e2e.running import ROOT, TOKEN, start_server, stop_server


@dataclass(frozen=True)
class Said:
    """What a command wrote."""

    stdout: str
    stderr: str


def farhand(*arguments: str, fails: bool = False) -> Said:
    """Run ``farhand`` and hold that it ends as it should.

    In this process: to import the database and the pipeline anew for each of some sixty commands
    would take minutes. ``test_the_wheel_works_in_an_empty_folder`` runs the program itself.
    """
    out, err = StringIO(), StringIO()
    with (
        patch.object(sys, "argv", ["farhand", *arguments]),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            main()
            code: object = 0
        except SystemExit as end:
            code = end.code
    assert bool(code) == fails, out.getvalue() + err.getvalue()
    return Said(out.getvalue(), err.getvalue())


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """A picture of a hand."""
    path = tmp_path / "hand.jpg"
    cv2.imwrite(str(path), render_hand(POSES["home"], (640, 480)))
    return path


def hand_in_a_room() -> bytes:
    """JPEG of a drawn hand before patches of many colours."""
    size = (320, 240)
    sprite = render_sprite(POSES["stop"], size, HandView(150, (150, 130)), HandLook())
    patches = np.random.default_rng(3).uniform(40, 220, (6, 8, 3))
    room = cv2.resize(np.kron(patches, np.ones((40, 40, 1))), size).astype(np.float32)
    picture = compose(sprite, room).clip(0, 255).astype(np.uint8)
    return cv2.imencode(".jpg", picture)[1].tobytes()


def test_gestures_are_enrolled_listed_exported_and_imported(tmp_path: Path, photo: Path) -> None:
    data, other = str(tmp_path / "data"), str(tmp_path / "other")
    farhand("enroll", "wave", str(photo), "--action", '{"type":"home"}', "--data-dir", data)
    rows = json.loads(farhand("gestures", "list", "--json", "--data-dir", data).stdout)
    assert len(rows) == 11
    assert {"name": "wave", "action": {"type": "home"}, "samples": 1}.items() <= rows[-1].items()

    farhand("gestures", "export", str(tmp_path / "set"), "--data-dir", data)
    farhand("gestures", "import", str(tmp_path / "set"), "--replace", "--data-dir", other)
    again = json.loads(farhand("gestures", "list", "--json", "--data-dir", other).stdout)
    assert {row["name"] for row in again} == {row["name"] for row in rows}


def test_each_of_several_people_has_gestures_of_their_own(tmp_path: Path, photo: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    told = farhand("gestures", "list", "--gallery", "Ann", *data, fails=True).stderr
    assert "there is no gallery 'Ann'; there are: Shared" in told
    store = GestureStore(f"sqlite:///{tmp_path / 'data' / 'gestures.db'}", None)
    store.galleries.create("Ann")
    store.galleries.create("Bob")
    store.close()
    home, folder = ("--action", '{"type":"home"}'), str(tmp_path / "set")
    said = farhand("enroll", "wave", str(photo), *home, "--gallery", "ann", *data).stdout
    assert "likely to be taken for 'home'" in said
    assert "11 gestures" in farhand("gestures", "export", folder, "--gallery", "Ann", *data).stdout
    into = ("--replace", "--gallery", "Bob")
    assert "Bob now holds 11" in farhand("gestures", "import", folder, *into, *data).stdout
    assert "wave" in farhand("gestures", "list", "--gallery", "BOB", *data).stdout
    assert "wave" not in farhand("gestures", "list", *data).stdout


def test_the_start_waits_for_no_part_that_a_command_may_not_need() -> None:
    code = "import sys, app.cli; print(*sorted({name.split('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    heavy = {"sqlalchemy", "alembic", "numpy", "cv2", "fastapi", "starlette", "pybullet", "zenoh"}
    assert heavy.isdisjoint(done.stdout.split()), done.stdout + done.stderr
    assert "typer" in done.stdout


def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, photo: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    cases = [
        (("enroll", "x", str(photo), "--action", '{"type":"fly"}', *data), "action is not valid"),
        (("enroll", "stop", str(photo), "--action", '{"type":"home"}', *data), "stop"),
        (("enroll", "x", "nowhere.jpg", "--action", '{"type":"home"}', *data), "nowhere.jpg"),
        (("evaluate", str(tmp_path / "none")), "none"),
        (("serve", "--tls-cert", "nowhere.pem", *data), "HTTPS"),
        (("serve", "--root-path", "/arm", *data), "--behind-proxy"),
        (("token", "make", "--role", "king", *data), "operator or observer"),
        (("token", "make", "--role", "observer", "--expires", "1y", *data), "30d, 12h"),
        (("token", "revoke", "nobody", *data), "there is no token"),
        (("trust", *data), "there is no certificate authority"),
        (("serve", "--port", "99999", *data), "port"),
    ]
    for arguments, expected in cases:
        told = farhand(*arguments, fails=True).stderr.strip().splitlines()[-1]
        assert told.startswith("farhand: ") and expected in told, told


def test_backups_are_listed_and_restored(tmp_path: Path, photo: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    assert farhand("gestures", "backups", *data).stdout == ""
    farhand("enroll", "wave", str(photo), "--action", '{"type":"home"}', *data)
    place = Place(tmp_path / "data" / "gestures.db", tmp_path / "data" / "backups")
    made = backup.make(place, 5)
    assert made is not None
    bad = made.with_name("gestures-20200101T000000.000000Z.db")
    bad.write_bytes(b"\xff" * 5000)
    first, second = farhand("gestures", "backups", *data).stdout.splitlines()
    assert first.startswith(made.name) and first.endswith("11 gestures")
    assert second.startswith(bad.name) and "damaged" in second

    # What SQLite says about a damaged schema is no text; no command may stumble over it.
    sound = place.database.read_bytes()
    place.database.write_bytes(
        sound.replace(b"CREATE TABLE sample", b"CREATE \xff\xfe\xffLE sample")
    )
    told = farhand("gestures", "list", *data, fails=True).stderr
    assert "is damaged" in told and "farhand gestures restore" in told
    assert "damaged" in farhand("gestures", "restore", bad.name, *data, fails=True).stderr

    assert "11 gestures are back" in farhand("gestures", "restore", *data).stdout
    assert "wave" in farhand("gestures", "list", *data).stdout
    place.database.unlink()
    # No new starter set in the place of what is lost.
    assert "gone" in farhand("gestures", "list", *data, fails=True).stderr
    assert "11 gestures are back" in farhand("gestures", "restore", made.name, *data).stdout
    both = farhand("gestures", "restore", made.name, "--accept-new", *data, fails=True).stderr
    assert "not both" in both
    place.marker.write_text("{}")
    assert "are kept" in farhand("gestures", "restore", "--accept-new", *data).stdout
    assert "nothing was set aside" in farhand("gestures", "restore", "--accept-new", *data).stdout


def test_a_photo_without_a_hand_is_refused_and_nothing_is_enrolled(
    tmp_path: Path, photo: Path
) -> None:
    blank = tmp_path / "blank.png"
    cv2.imwrite(str(blank), np.full((480, 640, 3), 200, np.uint8))
    data = ("--data-dir", str(tmp_path / "data"))
    action = ("--action", '{"type":"home"}')
    told = farhand("enroll", "x", str(photo), str(blank), *action, *data, fails=True).stderr
    assert "no hand" in told
    rows = json.loads(farhand("gestures", "list", "--json", *data).stdout)
    assert len(rows) == 10


def test_enrolling_says_what_is_wrong_and_what_may_be_confused(tmp_path: Path, photo: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    action = ("--action", '{"type":"home"}')
    blurred = tmp_path / "blurred.jpg"
    picture = cv2.imread(str(photo))
    assert picture is not None
    cv2.imwrite(str(blurred), cv2.GaussianBlur(picture, (0, 0), 10))
    told = farhand("enroll", "x", str(blurred), *action, *data, fails=True).stderr
    assert f"{blurred}: the picture is blurred" in told
    said = farhand("enroll", "x", str(photo), *action, *data, "--inactive").stdout
    assert "enrolled 'x' with 1 samples, inactive" in said
    assert "likely to be taken for 'home'" in said
    assert "choose another sign" in said
    assert "(inactive)" in farhand("gestures", "list", *data).stdout
    files = [str(photo), str(photo), str(blurred)]
    said = farhand("enroll", "y", *files, *action, *data, "--burst").stdout
    assert "left out: 1 near duplicate, 1 blurred" in said
    assert "enrolled 'y' with 1 samples" in said


def test_evaluate_prints_json(tmp_path: Path) -> None:
    for name in ("up", "stop"):
        folder = tmp_path / "set" / name
        folder.mkdir(parents=True)
        for number in range(3):
            picture = render_hand(POSES[name], (320, 240), seed=number)
            cv2.imwrite(str(folder / f"{number}.jpg"), picture)
    arguments = ("--shots", "1", "--trials", "2", "--seed", "3", "--json", "-")
    result = json.loads(farhand("evaluate", str(tmp_path / "set"), *arguments).stdout)
    assert result["accuracy"]["mean"] == 1.0
    assert set(result["per_label"]) == {"up", "stop"}
    assert {"confusion", "rejected", "unknown_accepted", "ms_per_image"} <= set(result)


def test_replay_prints_events_as_json_lines(tmp_path: Path) -> None:
    video = tmp_path / "video.mjpeg"
    write_mjpeg(SyntheticOperator((Step(None, 0.3), Step("up", 0.8))).frames(), video)
    lines = farhand("replay", str(video), "--data-dir", str(tmp_path / "data")).stdout.splitlines()
    records = [json.loads(line) for line in lines]
    starts = [r["gesture"] for r in records if r["type"] == "gesture" and r["phase"] == "start"]
    assert starts == ["up"]
    assert any(r["reason"] for r in records if r["type"] == "frame")


def test_tokens_are_made_listed_and_revoked(tmp_path: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    options = ("--role", "observer", "--name", "Anna's tablet", "--expires", "12h")
    made = json.loads(farhand("token", "make", *options, "--json", *data).stdout)
    assert len(made["token"]) == 43
    # No server has run here yet, so nobody knows its address.
    assert made["link"] is None
    (tmp_path / "data" / "address").write_text("https://arm.local:8000/\n")
    said = farhand("token", "make", "--role", "operator", "--expires", "never", *data).stdout
    assert re.search(r"^link:  https://arm\.local:8000/\?token=\S{43}$", said, re.MULTILINE)
    listed = farhand("token", "list", *data).stdout
    assert "Anna's tablet" in listed and "does not expire" in listed
    assert made["token"] not in listed
    assert "revoked" in farhand("token", "revoke", made["id"], *data).stdout
    rows = json.loads(farhand("token", "list", "--json", *data).stdout)
    assert [row["role"] for row in rows] == ["operator"]


def test_what_commands_write_is_their_users_alone(tmp_path: Path, photo: Path) -> None:
    data, exported = tmp_path / "data", tmp_path / "set"
    home = ("--action", '{"type":"home"}')
    before = os.umask(0o022)
    try:
        farhand("token", "make", "--role", "observer", "--data-dir", str(data))
        farhand("enroll", "wave", str(photo), *home, "--data-dir", str(data))
        farhand("gestures", "export", str(exported), "--data-dir", str(data))
        farhand("gestures", "export", str(tmp_path / "set.zip"), "--data-dir", str(data))
        made = [data, *data.rglob("*"), exported, *exported.rglob("*"), tmp_path / "set.zip"]
        assert {f"{path.stat().st_mode & 0o077:03o}" for path in made} == {"000"}
        # A folder that an older version left open is mended by the next command.
        data.chmod(0o755)
        (data / "gestures.db").chmod(0o644)
        farhand("token", "list", "--data-dir", str(data))
        assert (data.stat().st_mode | (data / "gestures.db").stat().st_mode) & 0o077 == 0
    finally:
        os.umask(before)


def test_the_fingerprint_of_the_authority_is_told(tmp_path: Path) -> None:
    authority = LocalAuthority(tmp_path / "data" / "tls", machine_names)
    authority.prepare()
    said = farhand("trust", "--data-dir", str(tmp_path / "data")).stdout
    assert said == f"SHA-256 {authority.public.fingerprint}\n{authority.public.pem.decode()}"


def test_the_wheel_works_in_an_empty_folder(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, check=True, capture_output=True, cwd=ROOT)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        for network in ("hand_mask.onnx", "hand_shape.onnx"):
            assert f"app/pipeline/models/{network}" in archive.namelist()
        archive.extractall(tmp_path / "site")
    empty = tmp_path / "empty"
    empty.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    server = start_server(empty, cwd=empty, env=environment)
    try:
        signed_in = {"Authorization": f"Bearer {TOKEN}"}
        page = httpx.get(server.url + "/", headers=signed_in)
        assert "<title>Farhand</title>" in page.text
        gestures = httpx.get(server.url + "/api/gestures", headers=signed_in).json()
        assert len(gestures) == 10
        video = httpx.get(server.url + "/static/media/operator.webm", headers=signed_in)
        assert video.content[:4] == b"\x1aE\xdf\xa3"
        # By network, since the photo shows a room.
        answer = httpx.post(
            server.url + "/api/recognise", headers=signed_in, content=hand_in_a_room(), timeout=30
        ).json()
        assert answer["roi"] is not None, answer
        robot = httpx.get(server.url + "/api/robots", headers=signed_in).json()[0]
        assert robot["online"], robot
        where = server.node().environ()["PYTHONPATH"]
        assert where.startswith(str(tmp_path / "site"))
    finally:
        stop_server(server)


def test_a_program_is_tried_without_a_server(tmp_path: Path, photo: Path) -> None:
    data = ("--data-dir", str(tmp_path / "data"))
    far = '{"type":"move_linear","offset":[1.0,0,0]}'
    steps = f'{{"type":"sequence","steps":[{{"type":"home"}},{far}]}}'
    farhand("enroll", "reach", str(photo), "--action", steps, *data)
    done = farhand("gestures", "dry-run", "REACH", *data, fails=True)
    first, last = done.stdout.splitlines()
    assert "s  step 2: only " in first
    assert last.startswith("reach would meet a limit; it takes ")
    done = farhand("gestures", "dry-run", "forward", "--from", "left", *data)
    assert done.stdout.startswith("forward can be done; it takes 2.")
    for arguments, text in (
        (("nothing",), "there is no gesture 'nothing'"),
        (("forward", "--from", "moon"), "no pose 'moon' to begin at; it has: home, inspect"),
    ):
        assert text in farhand("gestures", "dry-run", *arguments, *data, fails=True).stderr


def test_the_networks_are_listed_and_taken_out_of_a_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    rows = json.loads(farhand("models", "list", "--json").stdout)
    assert len(rows) == 4
    assert all(row["path"] and "MediaPipe" in row["whose"] for row in rows)
    wheel = tmp_path / "some.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for row in rows:
            path = Path(row["path"])
            archive.write(path, f"mediapipe/modules/{path.parent.name}/{path.name}")
    assert "palm_detection_lite" in farhand("models", "add", "--wheel", str(wheel)).stdout
    own = json.loads(farhand("models", "list", "--json").stdout)
    assert all(Path(row["path"]).parent == tmp_path / "farhand" / "models" for row in own)
    wheel.write_bytes(b"broken")
    assert "some.whl" in farhand("models", "add", "--wheel", str(wheel), fails=True).stderr
