"""JSON and forms made to do harm: refused in plain words, quickly, and nothing is changed."""

import pytest

from app.errors import Invalid
from app.gateway.json_bodies import parse_action, parse_json
from tests.gateway.running import Running

DEEP = "[" * 30_000
JSON = {"Content-Type": "application/json"}
FORM = {"Content-Type": "multipart/form-data; boundary=x"}
PART = '--x\r\nContent-Disposition: form-data; name="{}"\r\n\r\n{}\r\n'


@pytest.mark.parametrize("text", [DEEP, '{"a":' * 10_000, "9" * 10_000, "NaN", "\ud800"])
def test_what_is_no_json_that_one_reads_is_refused(text: str) -> None:
    with pytest.raises(Invalid, match="action is not JSON"):
        parse_json(text, "action")


def test_an_action_within_actions_without_end_is_refused() -> None:
    action: dict[str, object] = {"type": "home"}
    for _ in range(900):
        action = {"type": "sequence", "steps": [action]}
    with pytest.raises(Invalid, match="action: "):
        parse_action(action)


def test_deep_json_is_refused_over_rest(lasting: Running) -> None:
    id = lasting.http.get("/api/gestures").json()[0]["id"]
    for body in (DEEP, '{"action":' + DEEP, '{"action":' * 6000):
        answer = lasting.http.patch(f"/api/gestures/{id}", content=body, headers=JSON)
        assert (answer.status_code, answer.json()["error"]["code"]) == (422, "invalid")


@pytest.mark.parametrize(
    "body",
    [
        "".join(PART.format(f"field{n}", "") for n in range(5000)) + "--x--\r\n",
        f"--x\r\nContent-Disposition: {'y' * 500_000}\r\n\r\n\r\n--x--\r\n",
        f"--x\r\n{'y' * 500_000}: z\r\n\r\n\r\n--x--\r\n",
        f"--x\r\n{'y: z' + chr(13) + chr(10)}" * 20_000 + "\r\n\r\n--x--\r\n",
        PART.format("name", "y" * 2_000_000) + "--x--\r\n",
    ],
    ids=["fields", "value", "name", "headers", "field"],
)
def test_a_form_made_to_do_harm_is_refused(lasting: Running, body: str) -> None:
    answer = lasting.http.post("/api/gestures/check", content=body.encode(), headers=FORM)
    assert answer.status_code == 400
    assert answer.json()["error"]["code"] == "bad_request"
