"""What a session sees of the recognition when it asks to."""

import base64
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.config import PipelineSettings
from tests.gateway.operating import Hand, show_until
from tests.gateway.running import Running, StandIn, running, settings_for


def decode(png: str) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return picture


def test_a_detail_view_brings_masks_and_distances(server: Running, hand: Hand) -> None:
    with server.operator() as operator:
        assert "detail" not in operator.show(hand("home"))
        operator.send("view", detail=True)
        frame = show_until(
            operator, hand("home"), lambda frame: "detail" in frame and frame["match"]
        )
        detail = frame["detail"]
        assert set(detail) == {"mask", "template", "distances", "threshold", "wrist"}, (
            "what lies between comes only for who asks"
        )
        assert detail["distances"]["home"] < detail["threshold"]
        template = decode(detail["template"])
        assert template.shape == (80, 60)
        assert set(np.unique(template)) == {0, 255}
        assert decode(detail["mask"]).shape[1] == 160
        operator.send("view", detail=False)
        operator.send("ping", t=0)
        operator.next("pong")
        assert "detail" not in operator.show(hand("home"))


@pytest.fixture
def by_silhouettes(node: StandIn, folder: Path) -> Iterator[Running]:
    pipeline = PipelineSettings.model_validate({"landmarks": {"mode": "off"}})
    settings = settings_for(folder, node.endpoint).model_copy(update={"pipeline": pipeline})
    with running(settings) as here:
        yield here


def test_the_glass_box_gets_every_step_between(by_silhouettes: Running, hand: Hand) -> None:
    server = by_silhouettes
    with server.operator() as operator:
        operator.send("view", detail=True, glass=True)
        frame = show_until(
            operator, hand("home"), lambda frame: "detail" in frame and frame["match"]
        )
        glass = frame["detail"]["glass"]
        assert decode(glass["mismatch"]).shape == decode(frame["detail"]["mask"]).shape
        assert frame["motion"] < glass["motion_limit"]
        # The palm is in the box; the histogram is that of the mask, with its maximum at the palm.
        x, y, width, height = frame["roi"]
        assert x < glass["palm"]["x"] < x + width
        assert y < glass["palm"]["y"] < y + height
        assert glass["histogram"]["axis"] == "y"
        assert frame["detail"]["wrist"]["side"] == "bottom"
        mask = decode(frame["detail"]["mask"]) > 0
        assert np.mean(glass["histogram"]["shares"]) == pytest.approx(mask.mean(), abs=0.02)

        gestures = {g["id"]: g for g in server.http.get("/api/gestures").json()}
        nearest = glass["nearest"]
        assert len(nearest) == 5
        assert [each["distance"] for each in nearest] == sorted(e["distance"] for e in nearest)
        for each in nearest:
            assert gestures[each["id"]]["name"] == each["gesture"]
            assert 0 <= each["sample"] < gestures[each["id"]]["samples"]
        # It is that sample, and no other: as the server draws it.
        best = nearest[0]
        url = f"/api/gestures/{best['id']}/template.png?sample={best['sample']}"
        drawn = cv2.imdecode(
            np.frombuffer(server.http.get(url).content, np.uint8), cv2.IMREAD_GRAYSCALE
        )
        assert drawn is not None
        assert np.mean((drawn > 0) == (decode(frame["detail"]["template"]) > 0)) > 0.9

        answer = glass["answer"]
        distances = frame["detail"]["distances"]
        first, second = sorted(distances, key=distances.__getitem__)[:2]
        assert (answer["gesture"], answer["second"], answer["accepted"]) == (first, second, True)
        assert answer["margin"] == pytest.approx(distances[second] - distances[first], abs=2e-4)
        assert answer["margin"] > answer["min_margin"]

        projection = glass["projection"]
        assert sorted(projection["gestures"]) == sorted(distances)
        assert len(projection["templates"]) == sum(g["samples"] for g in gestures.values())
        places = np.array([template[1:] for template in projection["templates"]])
        nearest = np.linalg.norm(places - projection["query"], axis=1).argmin()
        assert projection["gestures"][projection["templates"][nearest][0]] == "home"
        assert 0 < sum(projection["share"]) < 1

        operator.send("view", detail=True)
        operator.send("ping", t=0)
        operator.next("pong")
        frame = show_until(operator, hand("home"), lambda frame: "detail" in frame)
        assert "glass" not in frame["detail"]


def test_the_glass_box_of_an_empty_room_shows_that_nothing_is_there(
    server: Running, hand: Hand
) -> None:
    with server.operator() as operator:
        operator.send("view", detail=True, glass=True)
        frame = show_until(
            operator, hand(None), lambda frame: "detail" in frame and frame["motion"] is not None
        )
        assert frame["cause"] == "no_hand"
        glass = frame["detail"]["glass"]
        assert not decode(glass["mismatch"]).any()
        assert (glass["palm"], glass["histogram"], glass["nearest"]) == (None, None, [])
        assert (glass["answer"], glass["projection"]["query"]) == (None, None)
        assert glass["projection"]["templates"]
