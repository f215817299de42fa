"""The half of a sign-in that the page holds."""

from typing import Any

import pytest
from starlette.datastructures import Headers

from app.gateway.page_secret import (
    PAGE_PROTOCOL,
    PROTOCOL,
    PageProof,
    fragment,
    hide_proof,
    page_secret,
    parse_proof,
    proof_of,
    view_ticket,
)
from app.gateway.tokens import cookie_of, sha256

DIGEST = sha256("a token")
HALF, BROWSER = page_secret(DIGEST), "0123456789abcdef"


def test_the_halves_are_different_and_none_is_the_token_or_its_hash() -> None:
    made = {HALF, view_ticket(DIGEST), cookie_of("a token"), DIGEST, sha256(cookie_of("a token"))}
    assert len(made) == 5
    assert fragment(DIGEST) == f"#page={HALF}.{view_ticket(DIGEST)}"
    assert page_secret(sha256("another")) != HALF


@pytest.mark.parametrize(
    "text",
    ["", HALF, f"{HALF}.", f"{HALF}.{BROWSER}0", f"{HALF[1:]}.{BROWSER}", f"{HALF}.{'g' * 16}"],
)
def test_half_of_a_proof_is_none(text: str) -> None:
    assert parse_proof(text) is None


def test_a_page_shows_it_in_a_header_or_a_subprotocol() -> None:
    proof = PageProof(HALF, BROWSER)
    assert proof_of(Headers({"farhand-page": f"{HALF}.{BROWSER}"})) == proof
    offered = f"{PROTOCOL}, {PAGE_PROTOCOL}{HALF}.{BROWSER}"
    assert proof_of(Headers({"sec-websocket-protocol": offered})) == proof
    assert proof_of(Headers({"sec-websocket-protocol": "viser-v1"})) is None


def test_nothing_behind_the_door_sees_it() -> None:
    scope: dict[str, Any] = {
        "subprotocols": ["viser-v1", PROTOCOL, f"{PAGE_PROTOCOL}{HALF}.{BROWSER}"],
        "headers": [
            (b"host", b"here"),
            (b"farhand-page", b"x"),
            (b"sec-websocket-protocol", f"viser-v1, {PAGE_PROTOCOL}{HALF}".encode()),
        ],
    }
    assert hide_proof(scope) == PROTOCOL
    assert scope["subprotocols"] == ["viser-v1"]
    assert scope["headers"] == [(b"host", b"here"), (b"sec-websocket-protocol", b"viser-v1")]
    assert hide_proof({"headers": []}) is None
