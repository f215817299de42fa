"""The timeline and people's settings, asked of a real server."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
import simplejpeg

from app.config import MemorySettings
from app.gateway.diary.diary import FILE
from app.gateway.tokens import TokenStore
from app.link.messages import Transition
from tests.gateway.operating import rest, show_until, take_and_arm
from tests.gateway.running import (
    Operator,
    Running,
    StandIn,
    StandInCamera,
    running,
    settings_for,
    wait_for,
)
from tests.gateway.test_rest_galleries import make
from tests.gateway.test_rest_gestures import JOG, enrol, error

Hand = Callable[..., bytes]
SLOW_S = 60.0
"""No test here is about speed."""


def events(server: Running, *kinds: str) -> list[dict[str, Any]]:
    """Newest first."""
    answer = server.http.get("/api/timeline", params={"kind": kinds, "limit": 200})
    assert answer.status_code == 200, answer.text
    found: list[dict[str, Any]] = answer.json()["events"]
    return found


def event(server: Running, kind: str, **fields: Any) -> dict[str, Any]:
    """Wait for the newest event of a kind, with these fields."""
    return until(
        lambda: [
            each
            for each in events(server, kind)[:1]
            if all(each[name] == value for name, value in fields.items())
        ],
        server,
        f"{kind} {fields}",
    )[0]


def until(
    found: Callable[[], list[dict[str, Any]]], server: Running, what: str
) -> list[dict[str, Any]]:
    """Wait for events; without asking so often that the server has nothing else to do."""
    deadline = time.monotonic() + SLOW_S
    while not (there := found()):
        assert time.monotonic() < deadline, f"no {what} in {events(server)}"
        time.sleep(0.05)
    return there


def obeyed(server: Running) -> list[dict[str, Any]]:
    """Gestures that moved the robot, with their pictures."""
    return [each for each in events(server, "gesture") if each["picture"] and each["data"]["moves"]]


def drive(server: Running, operator: Operator, hand: Hand) -> None:
    """Show a gesture until it is obeyed and told: a starved machine loses control at times."""
    deadline = time.monotonic() + 2 * SLOW_S
    while not obeyed(server):
        assert time.monotonic() < deadline, f"no gesture was obeyed: {events(server)}"
        take_and_arm(operator)
        show_until(operator, hand(None), lambda frame: frame["gesture"] is None, SLOW_S)
        time.sleep(0.6)  # or it is the same showing
        rest(operator, hand(None))
        show_until(operator, hand("forward"), lambda frame: frame["gesture"] is not None, SLOW_S)
        time.sleep(0.5)


def test_driving_is_told_with_hand_and_robot_and_is_there_after_a_restart(
    node: StandIn, folder: Path, hand: Hand
) -> None:
    picture = simplejpeg.encode_jpeg(np.full((240, 320, 3), 90, np.uint8), colorspace="BGR")
    with running(settings_for(folder, node.endpoint)) as server:
        with StandInCamera(node, "scene", jpeg=picture), server.operator() as operator:
            me = operator.hello["session"]
            drive(server, operator, hand)
            show_until(operator, hand(None), lambda frame: frame["gesture"] is None, SLOW_S)
            (shown, *_) = until(
                lambda: [each for each in obeyed(server) if each["duration_s"]],
                server,
                "end of it",
            )
            operator.next("timeline")
        assert (shown["data"]["gesture"], shown["data"]["who"]) == ("forward", me)
        assert shown["template"]
        assert shown["data"]["action"]["type"] == "jog_cartesian"
        event(server, "control", data={"who": None, "before": me})
        path = f"/api/timeline/{shown['id']}"
        jpeg = server.http.get(f"{path}/picture.jpg")
        assert jpeg.headers["content-type"] == "image/jpeg"
        assert simplejpeg.decode_jpeg(jpeg.content).shape == (120, 160, 3)
        png = np.frombuffer(server.http.get(f"{path}/template.png").content, np.uint8)
        template = cv2.imdecode(png, cv2.IMREAD_GRAYSCALE)
        assert template is not None
        assert template.shape == (80, 60)
        assert 0.1 < (template > 0).mean() < 0.9
        before = events(server)
    with running(settings_for(folder, node.endpoint)) as server:
        until(lambda: events(server, "started")[1:], server, "second start")
        after = events(server)
        assert [one for one in after if one["id"] <= before[0]["id"]] == before
        assert server.http.get(f"{path}/picture.jpg").content == jpeg.content


def test_what_moves_nothing_is_not_told_but_a_stop_of_anybody_is(
    server: Running, node: StandIn, hand: Hand
) -> None:
    with server.operator() as operator:
        rest(operator, hand(None))
        show_until(operator, hand("forward"), lambda frame: frame["gesture"] is not None)
        show_until(operator, hand(None), lambda frame: frame["gesture"] is None)
        show_until(operator, hand("stop"), lambda frame: frame["gesture"] == "stop")
        assert event(server, "gesture")["data"]["gesture"] == "stop"
        assert len(events(server, "gesture")) == 1
        wait_for(lambda: node.stops, "the stop")
        stop = node.stops[0]
        # The robot tells it as the supervisor's step, in the words that it was given.
        why = f"{stop.reason} ({stop.source})"
        step = Transition(number=2, tick=9, before="armed", after="stopped", stop="S1", reason=why)
        node.steps = (*node.steps, step)
        told = event(server, "stop")["data"]
    assert (told["category"], told["by"], told["who"]) == ("S1", "gesture", stop.source)


def test_a_stop_that_is_not_confirmed_and_a_robot_that_is_silent_are_told(
    server: Running, node: StandIn
) -> None:
    node.deaf_to_stops = True
    assert server.http.post("/api/robots/puma/stop").status_code == 503
    assert event(server, "unconfirmed")["data"] == {"who": "rest", "by": "rest"}
    node.silent = True
    event(server, "robot_lost", duration_s=None)
    node.silent = False
    event(server, "robot_back")
    assert event(server, "robot_lost")["duration_s"] > 0


def test_keys_are_one_event(server: Running) -> None:
    with server.operator() as operator:
        take_and_arm(operator)
        for hold in (1, 2):
            for action in (JOG, None):
                jog = {"hold": hold, "action": action, "tick": operator.tick}
                operator.send("jog", **jog)
        event(server, "keys", duration_s=None)
    told = until(
        lambda: [each for each in events(server, "keys") if each["duration_s"] is not None],
        server,
        "end of the session",
    )
    assert [each["data"]["presses"] for each in told] == [2]


def test_gestures_are_told_whoever_changes_them(server: Running, hand: Hand) -> None:
    server.http.timeout = SLOW_S
    wave = enrol(server, "wave", JOG, hand("up")).json()
    taught = event(server, "enrolled", template=True)
    assert taught["data"] == {"gesture": "wave", "gallery": "shared"}
    server.hub.store.update(wave["id"], active=False)  # as another process would
    assert event(server, "retired")["data"]["how"] == "inactive"
    ann = make(server, "Ann")
    assert event(server, "gallery")["data"] == {"gallery": ann, "what": "made", "gestures": 11}


def test_pages_kinds_and_nonsense(server: Running) -> None:
    for name in ("Ann", "Ben", "Cleo"):
        make(server, name)
    until(lambda: events(server, "gallery")[2:], server, "third gallery")
    whole = events(server)
    paged: list[dict[str, Any]] = []
    before = None
    while True:
        params = {"limit": 1} | ({} if before is None else {"before": before})
        page = server.http.get("/api/timeline", params=params).json()
        paged += page["events"]
        before = page["before"]
        if before is None:
            break
    assert paged == whole
    assert page["lost"] == 0
    ids = [each["id"] for each in whole]
    assert ids == sorted(ids, reverse=True)
    for bad in ("limit=0", "limit=201", "before=0", "before=x", "kind=fly", "kind=stop&kind="):
        error(server.http.get(f"/api/timeline?{bad}"), 422, "invalid")
    error(server.http.get("/api/timeline.jsonl?kind=fly"), 422, "invalid")
    for path in ("99999/picture.jpg", "99999/template.png", f"{ids[-1]}/picture.jpg"):
        error(server.http.get(f"/api/timeline/{path}"), 404, "not_found")
    for path in ("0/picture.jpg", "x/template.png", f"{2**63}/picture.jpg"):
        error(server.http.get(f"/api/timeline/{path}"), 422, "invalid")
    saved = server.http.get("/api/timeline.jsonl", params={"kind": "gallery"})
    assert saved.headers["content-type"].startswith("application/jsonl")
    assert "attachment" in saved.headers["content-disposition"]
    lines = [json.loads(line) for line in saved.text.splitlines()]
    assert lines == events(server, "gallery")


def test_wrong_tokens_are_told_to_operators_alone(server: Running) -> None:
    wrong = {"Authorization": "Bearer wrong-token"}
    assert httpx.get(f"{server.url}/api/robots", headers=wrong, trust_env=False).is_error
    told = event(server, "sign_in")
    assert told["data"] == {"count": 1}
    tokens = TokenStore(server.hub.settings.data_dir / "tokens.json")
    observer = {"Authorization": f"Bearer {tokens.make('observer', 'Anna').secret}"}
    with httpx.Client(base_url=server.url, headers=observer, trust_env=False) as client:
        shown = client.get("/api/timeline").json()["events"]
        assert {each["kind"] for each in shown} >= {"started"}
        assert "sign_in" not in {each["kind"] for each in shown}
        assert client.get("/api/timeline?kind=sign_in").json()["events"] == []
        assert "sign_in" not in client.get("/api/timeline.jsonl").text
        saved = client.get(f"/api/timeline/{told['id']}/picture.jpg")
        assert f"no event with the id {told['id']}" in error(saved, 404, "not_found")


def test_a_server_whose_memory_cannot_be_opened_drives_without(node: StandIn, folder: Path) -> None:
    (folder / "data" / FILE).mkdir()
    with running(settings_for(folder, node.endpoint)) as server:
        with server.operator() as operator:
            take_and_arm(operator)
            operator.send("stop")
            wait_for(lambda: node.stops, "the stop")
        message = error(server.http.get("/api/timeline"), 503, "memory_unavailable")
        assert "nothing is remembered" in message
        error(server.http.get("/api/timeline.jsonl"), 503, "memory_unavailable")
        assert "farhand_timeline_lost" in server.http.get("/metrics").text
        assert server.hub.diary.lost > 0


def test_settings_go_with_their_person(server: Running) -> None:
    api, ann, ben = server.http, make(server, "Ann"), make(server, "Ben")
    path = f"/api/galleries/{ann}/settings"
    nothing = {
        "speed": None, "fine": None, "large": None, "glass": None, "language": None, "source": None,
    }  # fmt: skip
    assert api.get(path).json() == nothing
    assert api.patch(path, json={"speed": 0.25, "source": "keys"}).json()["speed"] == 0.25
    chosen = {**nothing, "speed": 0.25, "source": "keys", "glass": True}
    assert api.patch(path, json={"glass": True}).json() == chosen
    assert api.get(path).json() == chosen
    assert api.get(f"/api/galleries/{ben}/settings").json() == nothing
    for bad in ({}, [], {"speed": 2}, {"speed": "1"}, {"armed": True}, {"fine": 1}):
        error(api.patch(path, json=bad), 422, "invalid")
    error(api.patch(path, content=b"{}"), 415, "unsupported_media_type")
    assert api.get(path).json() == chosen
    error(api.patch("/api/galleries/nobody/settings", json={"fine": True}), 404, "not_found")
    error(api.get("/api/galleries/nobody/settings"), 404, "not_found")
    error(api.patch("/api/galleries/shared/settings", json={"fine": True}), 409, "shared_gallery")
    assert api.get("/api/galleries/shared/settings").json() == nothing
    assert api.delete(f"/api/galleries/{ann}").status_code == 204
    error(api.get(path), 404, "not_found")
    kept = server.hub.diary.settings
    wait_for(lambda: kept.get(ann).speed is None, "her choices to be forgotten")


def test_settings_that_cannot_be_kept_say_so(server: Running, monkeypatch: Any) -> None:
    ann = make(server, "Ann")
    server.hub.diary._database.close()  # type: ignore[union-attr]
    answer = server.http.patch(f"/api/galleries/{ann}/settings", json={"fine": True})
    error(answer, 503, "memory_unavailable")


@pytest.mark.parametrize("big", [{"events": 99}, {"bytes": 1000}, {"more": 1}])
def test_bounds_have_bounds(big: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="1 validation error"):
        MemorySettings(**big)  # type: ignore[arg-type]
