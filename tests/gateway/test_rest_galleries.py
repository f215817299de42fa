"""Several people with galleries of their own, over REST and the operator WebSocket."""

from collections.abc import Callable
from typing import Any

import pytest

from app.gateway.tokens import TokenStore
from tests.gateway.operating import rest, show_until, take_and_arm
from tests.gateway.running import Operator, Running, StandIn, wait_for
from tests.gateway.test_rest_gestures import JOG, enrol, error

Hand = Callable[..., bytes]


def make(server: Running, name: str) -> str:
    answer = server.http.post("/api/galleries", json={"name": name})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def gestures(server: Running, gallery: str) -> dict[str, dict[str, Any]]:
    """By name."""
    answer = server.http.get("/api/gestures", params={"gallery": gallery})
    assert answer.status_code == 200, answer.text
    return {gesture["name"]: gesture for gesture in answer.json()}


def use(operator: Operator, gallery: str) -> None:
    operator.send("use_gallery", gallery=gallery)
    operator.next("gallery", gallery=gallery)


def shows(operator: Operator, jpeg: bytes) -> str:
    """What a hand is taken for, once it rests."""
    frame = show_until(operator, jpeg, lambda frame: frame["match"] is not None)
    return str(frame["match"]["gesture"])


def test_galleries_are_made_listed_renamed_and_deleted(server: Running) -> None:
    api = server.http
    (shared,) = api.get("/api/galleries").json()
    assert shared.keys() == {"id", "name", "shared", "gestures", "taught", "created"}
    assert (shared["id"], shared["shared"], shared["gestures"]) == ("shared", True, 10)
    with server.operator() as operator:
        ann = make(server, " Ann ")
        # Everybody is told, so that lists of galleries are up to date.
        assert operator.next("gallery")["version"] > operator.hello["gallery"]
    listed = api.get("/api/galleries").json()
    assert [gallery["name"] for gallery in listed] == ["Shared", "Ann"]
    assert (listed[1]["id"], listed[1]["shared"]) == (ann, False)
    assert (listed[1]["gestures"], listed[1]["taught"]) == (10, 0)
    assert error(api.post("/api/galleries", json={"name": "ANN"}), 409, "duplicate") == (
        "there is a gallery 'Ann' already; choose another name"
    )
    path = f"/api/galleries/{ann}"
    error(api.patch(path, json={"name": "shared"}), 409, "duplicate")
    assert api.patch(path, json={"name": "Anna"}).json()["name"] == "Anna"
    for bad in ({}, {"name": 5}, {"name": " "}, {"name": "x" * 61}, {"id": "x"}, []):
        error(api.post("/api/galleries", json=bad), 422, "invalid")
        error(api.patch(path, json=bad), 422, "invalid")
    error(api.post("/api/galleries", content=b"{}"), 415, "unsupported_media_type")
    error(api.delete("/api/galleries/shared"), 409, "shared_gallery")
    error(api.delete("/api/galleries/nobody"), 404, "not_found")
    error(api.patch("/api/galleries/nobody", json={"name": "x"}), 404, "not_found")
    assert api.delete(path).status_code == 204
    assert [gallery["id"] for gallery in api.get("/api/galleries").json()] == ["shared"]


def test_routes_about_gestures_take_a_gallery(server: Running, hand: Hand) -> None:
    api, image = server.http, [("images", hand("up"))]
    ann = make(server, "Ann")
    data = {"name": "wave", "action": '{"type":"home"}', "gallery": ann}
    made = api.post("/api/gestures", data=data, files=image).json()
    assert (made["gallery"], made["taught"]) == (ann, True)
    assert made["confusions"][0]["id"] == gestures(server, ann)["up"]["id"]
    assert "wave" in gestures(server, ann) and "wave" not in gestures(server, "shared")
    assert not gestures(server, ann)["up"]["taught"]
    assert enrol(server, "wave", JOG, hand("left")).json()["gallery"] == "shared"
    matrix = api.get("/api/gestures/confusions", params={"gallery": ann})
    for answer, gallery in ((matrix, ann), (api.get("/api/gestures/confusions"), "shared")):
        ids = {gesture["id"] for gesture in answer.json()["gestures"]}
        assert ids == {gesture["id"] for gesture in gestures(server, gallery).values()}
    checked = api.post("/api/gestures/check", data={"gallery": ann}, files=image).json()
    assert {one["gesture"] for one in checked["confusions"]} >= {"wave", "up"}
    both = {"gallery": "shared", "gesture": made["id"]}
    error(api.post("/api/gestures/check", data=both, files=image), 422, "invalid")
    own = {"gallery": ann, "gesture": made["id"]}
    assert api.post("/api/gestures/check", data=own, files=image).status_code == 200
    renamed = api.patch(f"/api/gestures/{made['id']}", json={"name": "back"})
    error(renamed, 409, "duplicate")
    gone = {"gallery": "nobody"}
    for answer in (
        api.get("/api/gestures", params=gone),
        api.get("/api/gestures/confusions", params=gone),
        api.post("/api/gestures", data={**data, **gone}, files=image),
        api.post("/api/gestures/check", data=gone, files=image),
        api.post("/api/recognise", data=gone, files=[("image", hand("up"))]),
    ):
        assert error(answer, 404, "not_found") == "there is no gallery with the id 'nobody'"


def test_samples_are_replaced_all_at_once_or_not_at_all(server: Running, hand: Hand) -> None:
    up = gestures(server, "shared")["up"]
    path = f"/api/gestures/{up['id']}/samples"
    replace = {"replace": "true"}
    for bad, status in (
        ([hand("left"), hand(None)], 422),
        ([hand("left"), b"no image"], 422),
        ([], 415),
    ):
        files = [("images", image) for image in bad]
        assert server.http.post(path, params=replace, files=files).status_code == status
    assert gestures(server, "shared")["up"] == up
    images = [("images", hand("left"))]
    error(server.http.post(path, params={"replace": "perhaps"}, files=images), 422, "invalid")
    answer = server.http.post(path, params=replace, files=images)
    assert answer.status_code == 201
    new = answer.json()
    assert (new["samples"], new["taught"]) == (1, True)
    assert set(new["sample_ids"]).isdisjoint(up["sample_ids"])
    assert new["confusions"][0]["gesture"] == "left"
    more = server.http.post(path, params={"replace": "false"}, files=images)
    assert more.json()["samples"] == 2


def test_two_people_are_recognised_each_by_their_own(server: Running, hand: Hand) -> None:
    ann = make(server, "Ann")
    mine = gestures(server, ann)
    for name, shown in (("forward", "up"), ("up", "forward")):
        answer = server.http.post(
            f"/api/gestures/{mine[name]['id']}/samples",
            params={"replace": "true"},
            files=[("images", hand(shown))],
        )
        assert answer.json()["taught"]
    assert server.http.get("/api/galleries").json()[1]["taught"] == 2
    for data, expected in (({}, "forward"), ({"gallery": ann}, "up")):
        found = server.http.post(
            "/api/recognise", data=data, files=[("image", hand("forward"))]
        ).json()
        assert found["match"]["gesture"] == expected
    with server.operator() as first, server.operator() as second:
        use(second, ann)
        for operator in (first, second):
            rest(operator, hand(None))
        assert (shows(first, hand("forward")), shows(second, hand("forward"))) == ("forward", "up")
        assert (shows(first, hand("up")), shows(second, hand("up"))) == ("up", "forward")
        second.send("use_gallery", gallery="nobody")
        told = second.next("error")
        assert (told["code"], told["message"]) == (
            "not_found",
            "there is no gallery with the id 'nobody'",
        )
        assert shows(second, hand("up")) == "forward"
        # What is taught counts at once, in its own gallery alone.
        server.http.patch(f"/api/gestures/{mine['forward']['id']}", json={"name": "hello"})
        second.next("gallery", gallery=ann)
        assert (shows(first, hand("up")), shows(second, hand("up"))) == ("up", "hello")
        use(second, "shared")
        assert shows(second, hand("up")) == "up"
        use(second, ann)
        assert server.http.delete(f"/api/galleries/{ann}").status_code == 204
        second.next("gallery", gallery="shared")
        assert shows(second, hand("forward")) == "forward"
        assert "farhand_galleries_fitted 1.0" in server.http.get("/metrics").text
    in_use = server.hub.gallery._users
    wait_for(lambda: in_use["shared"] == 1 and in_use[ann] == 0, "the sessions to let go")


def test_a_hand_that_is_up_when_the_gallery_changes_moves_nothing(
    server: Running, node: StandIn, hand: Hand
) -> None:
    ann = make(server, "Ann")
    with server.operator() as operator:
        take_and_arm(operator)
        rest(operator, hand(None))
        show_until(operator, hand("left"), lambda frame: frame["gesture"] == "left")
        wait_for(lambda: node.commands[-1].action, "an action")
        use(operator, ann)
        changed = "the gestures changed while a hand was up"
        for _ in range(5):
            frame = operator.show(hand("left"))
            assert frame["gesture"] is None or changed in frame["reason"]
        wait_for(lambda: node.commands[-1].frame == operator.seq, "the last command")
        assert [command.action for command in node.commands[-5:]] == [None] * 5
        # Deleted under the hand: the same.
        rest(operator, hand(None), 20)
        show_until(operator, hand("left"), lambda frame: frame["gesture"] == "left")
        wait_for(lambda: node.commands[-1].action, "an action")
        server.http.delete(f"/api/galleries/{ann}")
        operator.next("gallery", gallery="shared")
        frame = show_until(operator, hand("left"), lambda frame: frame["gesture"] == "left")
        assert changed in frame["reason"]
        wait_for(lambda: node.commands[-1].frame == operator.seq, "the last command")
        assert node.commands[-1].action is None


@pytest.mark.parametrize("gallery", [None, 5, "", "x" * 65])
def test_a_bad_choice_is_refused(lasting: Running, gallery: object) -> None:
    with lasting.operator() as operator:
        operator.send("use_gallery", gallery=gallery)
        assert operator.next("error")["code"] == "message_values"


def test_an_observer_looks_at_galleries_and_uses_none(server: Running) -> None:
    tokens = TokenStore(server.hub.settings.data_dir / "tokens.json")
    bearer = {"Authorization": f"Bearer {tokens.make('observer', 'Anna').secret}"}
    assert server.http.get("/api/galleries", headers=bearer).status_code == 200
    for method, path in (
        ("POST", "/api/galleries"),
        ("PATCH", "/api/galleries/shared"),
        ("DELETE", "/api/galleries/shared"),
    ):
        refused = server.http.request(method, path, json={"name": "x"}, headers=bearer)
        error(refused, 403, "not_allowed")
    with server.operator(additional_headers=bearer) as observer:
        observer.send("use_gallery", gallery="shared")
        assert observer.next("error")["code"] == "not_allowed"
