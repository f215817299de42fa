"""Several people at once, over real sockets."""

from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from app.gateway.tokens import TokenStore
from tests.gateway.running import Running, StandIn, running, settings_for


def test_who_drives_hands_over_to_who_asked(server: Running, node: StandIn) -> None:
    with server.operator() as first, server.operator() as second:
        a, b = first.hello["session"], second.hello["session"]
        first.next("people", operators=2, observers=0, asking=[])
        first.send("take_control")
        second.next("robot", controller=a)
        second.send("ask_control")
        first.next("people", asking=[b])
        first.send("hand_over", to=b)
        second.next("robot", controller=b, armed=False)
        first.next("people", asking=[])
        first.send("arm")
        assert first.next("error")["code"] == "no_control"
        second.send("arm")
        second.next("robot", armed=True)
        assert not any(r.takeover for r in node.requests if r.kind == "take")


def test_who_drives_may_drive_on(server: Running) -> None:
    with server.operator() as first, server.operator() as second:
        a = first.hello["session"]
        first.send("take_control")
        second.next("robot", controller=a)
        second.send("ask_control")
        first.next("people", asking=[second.hello["session"]])
        first.send("keep_control")
        error = second.next("error")
        assert error["code"] == "control_kept"
        assert a in error["message"]
        first.next("people", asking=[])
        first.send("hand_over", to=second.hello["session"])
        assert first.next("error")["code"] == "nobody_asks"
        second.next("robot", controller=a)


def test_only_who_drives_hands_over_and_only_who_watches_asks(server: Running) -> None:
    with server.operator() as first, server.operator() as second, server.operator() as third:
        second.send("ask_control")
        assert "nobody drives" in second.next("error")["message"]
        first.send("take_control")
        for session in (first, second):
            session.next("robot", controller=first.hello["session"])
        first.send("ask_control")
        assert "you drive already" in first.next("error")["message"]
        second.send("ask_control")
        third.next("people", asking=[second.hello["session"]])
        for kind, values in (
            ("hand_over", {"to": second.hello["session"]}),
            ("keep_control", {}),
        ):
            third.send(kind, **values)
            assert third.next("error")["code"] == "no_control"
        second.next("robot", controller=first.hello["session"])


def test_who_asked_and_went_asks_no_more(server: Running) -> None:
    with server.operator() as first:
        first.send("take_control")
        first.next("robot", controller=first.hello["session"])
        with server.operator() as second:
            second.next("robot", controller=first.hello["session"])
            second.send("ask_control")
            first.next("people", asking=[second.hello["session"]])
        first.next("people", operators=1, asking=[])
        first.send("release_control")
        first.next("robot", controller=None)


def test_once_nobody_drives_nobody_asks(server: Running) -> None:
    with server.operator() as first, server.operator() as second:
        first.send("take_control")
        second.next("robot", controller=first.hello["session"])
        second.send("ask_control")
        second.next("people", asking=[second.hello["session"]])
        first.send("release_control")
        second.next("people", asking=[])


def test_a_hundred_observers_have_room_and_the_next_is_told(node: StandIn, folder: Path) -> None:
    with running(settings_for(folder, node.endpoint)) as server:
        made = TokenStore(server.hub.settings.data_dir / "tokens.json").make("observer", "class")
        bearer = {"Authorization": f"Bearer {made.secret}"}
        # Nobody reads here: a queue that is full would keep a session from closing.
        unread = {"additional_headers": bearer, "max_queue": None}
        here = [server.operator(**unread) for _ in range(100)]
        try:
            here[0].next("people", observers=100)
            with pytest.raises(ConnectionClosed) as closed:
                server.operator(additional_headers=bearer)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert "100 observers are here already" in closed.value.rcvd.reason
            # An operator still comes in, and drives.
            with server.operator() as operator:
                operator.send("take_control")
                here[99].next("robot", controller=operator.hello["session"])
        finally:
            for session in here:
                session.close()
