"""A page whose server lost its gestures says so, until somebody decides how to go on."""

from pathlib import Path

import pytest
from playwright.sync_api import expect

from app.config import Settings
from app.gateway.gallery import place_of
from app.gestures import recovery
from tests.e2e.conftest import OpenPage
from tests.e2e.running import start_server, stop_server

pytestmark = pytest.mark.e2e


def test_lost_gestures_are_told_until_they_are_accepted(
    tmp_path: Path, open_page: OpenPage
) -> None:
    data = tmp_path / "data"
    data.mkdir()
    (data / "gestures.db").write_bytes(b"damaged" * 1000)
    server = start_server(tmp_path)
    try:
        page = open_page(server.link, allow_errors=True)  # the server ends first
        notice = page.locator("#notices .notice.bad")
        expect(notice).to_contain_text("cannot be armed")
        place = place_of(Settings(data_dir=data))
        assert place is not None and recovery.accept(place)
        expect(notice).to_be_hidden()
    finally:
        stop_server(server)
