"""Half of a surrogate pair is no character: 422 or a refusal wherever it stands, and no failure."""

import json
from typing import Any

import pytest

from app.gateway.unicode_text import NotUnicode, check_unicode
from tests.gateway.conftest import draw
from tests.gateway.running import Running

HALF = "\ud800"


@pytest.mark.parametrize("value", [HALF, [[HALF]], {"a": {"b": [HALF]}}, {HALF: 1}, "a\udfff"])
def test_it_is_found_anywhere(value: Any) -> None:
    with pytest.raises(NotUnicode, match="half of a surrogate pair"):
        check_unicode(value)


@pytest.mark.parametrize("value", ["\U0001f44d", "", None, 1.5, {"ü": ["中", True]}])
def test_text_is_let_through(value: Any) -> None:
    check_unicode(value)


def test_no_route_fails_over_it(server: Running) -> None:
    gesture = server.http.get("/api/gestures").json()[0]["id"]
    mine = server.http.post("/api/galleries", json={"name": "Ann"}).json()["id"]
    sample = server.http.get(f"/api/gestures/{gesture}").json()["sample_ids"][0]
    pose = {"type": "pose", "name": HALF}
    for method, path, body in (
        ("POST", "/api/galleries", {"name": HALF}),
        ("PATCH", f"/api/galleries/{mine}", {"name": f"a{HALF}"}),
        ("PATCH", f"/api/galleries/{mine}/settings", {"language": HALF}),
        ("PATCH", f"/api/galleries/{mine}/settings", {HALF: 1}),
        ("PATCH", f"/api/gestures/{gesture}", {"name": HALF}),
        ("PATCH", f"/api/gestures/{gesture}", {"action": pose}),
        ("PATCH", f"/api/gestures/{gesture}", {"action": {"type": HALF}}),
        ("POST", f"/api/gestures/{gesture}/samples/{sample}/move", {"to": HALF}),
        ("POST", "/api/robots/puma/dry-run", {"action": pose}),
        ("POST", "/api/robots/puma/dry-run", {"action": {"type": "home"}, "from": HALF}),
        ("POST", "/api/robots/puma/dry-run", {"action": {"type": "home"}, "view": HALF}),
    ):
        headers = {"Content-Type": "application/json"}
        answer = server.http.request(method, path, content=json.dumps(body), headers=headers)
        assert answer.status_code == 422, (path, body, answer.text)
        assert "surrogate" in answer.json()["error"]["message"], (path, body)


@pytest.mark.parametrize("charset", ["utf-7", "unicode_escape", "raw_unicode_escape"])
@pytest.mark.parametrize("field", ["name", "action", "gallery", "active"])
def test_no_encoding_of_a_form_brings_it_in(server: Running, charset: str, field: str) -> None:
    half = b"+2AA-" if charset == "utf-7" else rb"\ud800"
    fields = {"name": b"wave", "action": b'{"type":"home"}', field: half}
    image = draw("stop")
    body = b"".join(
        b'--b\r\nContent-Disposition: form-data; name="%s"\r\n\r\n%s\r\n' % (key.encode(), value)
        for key, value in fields.items()
    )
    body += b'--b\r\nContent-Disposition: form-data; name="images"; filename="a.jpg"\r\n'
    body += b"Content-Type: image/jpeg\r\n\r\n" + image + b"\r\n--b--\r\n"
    kind = {"Content-Type": f"multipart/form-data; boundary=b; charset={charset}"}
    answer = server.http.post("/api/gestures", content=body, headers=kind)
    assert answer.status_code in (400, 415, 422), answer.text


def test_no_message_and_no_address_fails_over_it(server: Running) -> None:
    with server.operator() as operator:
        for message in (
            {"type": "use_gallery", "gallery": HALF},
            {"type": "hand_over", "to": HALF},
            {"type": HALF},
            {HALF: 1, "type": "ping"},
        ):
            operator.socket.send(json.dumps(message))
            assert operator.next("error")["code"] == "message_not_json"
        operator.send("ping", t=1.0)
        operator.next("pong", t=1.0)
    for path in ("/api/gestures?gallery=%ED%A0%80", "/api/gestures/%ED%A0%80", "/%ED%A0%80"):
        assert server.http.get(path).status_code == 404, path
