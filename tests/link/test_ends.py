import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import zenoh

from app.errors import LinkFailed, RobotUnavailable
from app.link.actions import Home
from app.link.gateway_end import GatewayEnd
from app.link.header import FrameHeader
from app.link.messages import (
    Command,
    Description,
    LeaseReply,
    LeaseRequest,
    State,
    StopRequest,
    key,
)
from app.link.node_end import NodeEnd
from app.link.session import open_session, socket_endpoint

from .conftest import wait_for


def state(tick: int = 1, stops: int = 0) -> State:
    return State(
        robot="puma",
        tick=tick,
        mode="disarmed",
        armed=False,
        controller=None,
        epoch=0,
        stops=stops,
        joints=(0.0,) * 6,
        velocities=(0.0,) * 6,
        commanded=(0.0,) * 6,
        gripper=0.0,
        tool_position=(0.0, 0.0, 0.0),
        tool_orientation=(1.0, 0.0, 0.0, 0.0),
    )


def command(sequence: int) -> Command:
    return Command(epoch=1, sequence=sequence, tick=1, action=Home(), hold=1)


def raw(endpoint: str, what: str, payload: bytes) -> None:
    with open_session(endpoint, listen=False) as session:
        session.put(key("puma", what), payload)


def gather(read, until, what):
    found = []
    wait_for(lambda: found.extend(read()) or until(found), what)
    return found


def test_a_command_arrives_as_it_was_sent(node: NodeEnd, gateway: GatewayEnd) -> None:
    gateway.send(command(7))
    assert gather(node.commands, len, "the command") == [command(7)]
    assert node.commands() == []


def test_of_many_commands_the_newest_stay(node: NodeEnd, gateway: GatewayEnd) -> None:
    for sequence in range(500):
        gateway.send(command(sequence))
        time.sleep(0.0005)
    time.sleep(0.3)  # nobody reads meanwhile
    sequences = [c.sequence for c in node.commands()]
    assert sequences[-1] == 499
    assert len(sequences) <= 32


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xff\xfe",
        b"{}",
        b"[" * 20000,
        b'{"epoch":1,"sequence":1,"tick":1,"unknown":0}',
        b'{"epoch":1,"sequence":1,"tick":1,"action":{"type":"jog_joint","joint":1,"velocity":NaN}}',
        b'{"epoch":1,"sequence":-1,"tick":1}',
        b" " * 100_000,
    ],
)
def test_commands_that_cannot_be_read_are_counted(
    node: NodeEnd, endpoint: str, payload: bytes
) -> None:
    raw(endpoint, "command", payload)
    wait_for(lambda: node.commands() or node.invalid["command"], "counted")
    assert node.invalid["command"] == 1
    assert node.commands() == []


def test_a_stop_that_cannot_be_read_still_stops(node: NodeEnd, endpoint: str) -> None:
    raw(endpoint, "stop", b"please")
    (stop,) = gather(node.stop_requests, len, "the stop")
    assert (stop.category, stop.source) == ("S1", "unreadable")


def test_a_stop_arrives_while_commands_flood(node: NodeEnd, gateway: GatewayEnd) -> None:
    flooding = threading.Event()

    def flood() -> None:
        sequence = 0
        while not flooding.is_set():
            gateway.send(command(sequence := sequence + 1))

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        gather(node.commands, len, "the flood")
        sent = time.monotonic()
        gateway.stop(StopRequest(source="test", reason="enough"))
        stops = gather(node.stop_requests, len, "the stop")
        took = time.monotonic() - sent
    finally:
        flooding.set()
        thread.join()
    assert stops == [StopRequest(source="test", reason="enough")]
    assert took < 0.5


def test_states_reach_the_gateway(node: NodeEnd, endpoint: str) -> None:
    seen: list[State] = []
    with GatewayEnd("puma", endpoint, on_state=seen.append) as gateway:
        assert gateway.state is None
        assert gateway.state_age_s == float("inf")

        def published() -> bool:
            node.publish_state(state(tick=5))
            return bool(seen)

        wait_for(published, "a state")
        assert gateway.state == state(tick=5)
        assert gateway.state_age_s < 10.0


def test_a_slow_reader_sees_the_newest_state_and_no_backlog(node: NodeEnd, endpoint: str) -> None:
    seen: list[int] = []

    def slow(state: State) -> None:
        seen.append(state.tick)
        time.sleep(0.05)

    with GatewayEnd("puma", endpoint, on_state=slow):
        wait_for(lambda: node.publish_state(state(tick=1)) or seen, "the first state")
        for tick in range(2, 300):
            node.publish_state(state(tick=tick))
            time.sleep(0.001)
        wait_for(lambda: seen[-1] == 299, "the newest state")
        assert len(seen) < 100


def test_a_handler_that_raises_does_not_stop_the_link(
    node: NodeEnd, endpoint: str, caplog: pytest.LogCaptureFixture
) -> None:
    calls: list[int] = []

    def broken(state: State) -> None:
        calls.append(state.tick)
        raise RuntimeError("no")

    with GatewayEnd("puma", endpoint, on_state=broken):
        wait_for(lambda: node.publish_state(state()) or len(calls) >= 2, "two calls")
    assert "could not be handled" in caplog.text


def test_states_that_cannot_be_read_are_counted(
    node: NodeEnd, gateway: GatewayEnd, endpoint: str
) -> None:
    raw(endpoint, "state", b"{}")
    wait_for(lambda: gateway.invalid["state"], "counted")
    assert gateway.state is None


def answering(node: NodeEnd, reply: LeaseReply, until: threading.Event) -> threading.Thread:
    def run() -> None:
        while not until.is_set():
            for _request, answer in node.lease_requests():
                answer(reply)
            time.sleep(0.001)

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def test_a_lease_request_is_answered_by_the_loop(node: NodeEnd, gateway: GatewayEnd) -> None:
    done = threading.Event()
    thread = answering(node, LeaseReply(granted=True, epoch=3), done)
    try:
        reply = gateway.ask(LeaseRequest(kind="take", holder="anna"))
    finally:
        done.set()
        thread.join()
    assert reply == LeaseReply(granted=True, epoch=3)


def test_a_lease_request_that_cannot_be_read_is_refused(node: NodeEnd, endpoint: str) -> None:
    with open_session(endpoint, listen=False) as session:
        replies = session.get(key("puma", "lease"), payload=b"hm", timeout=2.0)
        wait_for(lambda: node.lease_requests() or node.invalid["leaserequest"], "seen")
        (reply,) = replies
    assert LeaseReply.model_validate_json(reply.ok.payload.to_bytes()).code == "invalid"


def test_a_node_that_hangs_is_unavailable(node: NodeEnd, gateway: GatewayEnd) -> None:
    with pytest.raises(RobotUnavailable, match=r"'puma' did not answer within 0.2 s"):
        gateway.ask(LeaseRequest(kind="renew", holder="anna"), timeout=0.2)


def test_a_description_is_answered_on_request(node: NodeEnd, gateway: GatewayEnd) -> None:
    description = Description(
        id="puma", name="P", model="m", joints=(), poses={}, gripper_max=0.1, cameras=()
    )
    result: list[Description] = []
    thread = threading.Thread(target=lambda: result.append(gateway.describe(2.0)))
    thread.start()
    wait_for(lambda: node.answer_descriptions(description) or result, "the answer")
    thread.join()
    assert result == [description]


def test_a_camera_is_watched_only_while_somebody_looks(
    node: NodeEnd, gateway: GatewayEnd, endpoint: str
) -> None:
    with open_session(endpoint, listen=False) as camera:
        publisher = camera.declare_publisher(key("puma", "camera/wrist"))
        assert not publisher.matching_status.matching
        seen: list[tuple[FrameHeader, bytes]] = []
        watch = gateway.watch_camera("wrist", lambda header, jpeg: seen.append((header, jpeg)))
        wait_for(lambda: publisher.matching_status.matching, "somebody watches")
        publisher.put(b"not a picture")
        wait_for(lambda: gateway.invalid["picture"], "the bad picture")
        publisher.put(FrameHeader(3, 1.5, 9).pack() + b"jpeg")
        wait_for(lambda: seen, "the picture")
        assert seen == [(FrameHeader(3, 1.5, 9), b"jpeg")]
        watch.close()
        wait_for(lambda: not publisher.matching_status.matching, "nobody watches")


def test_nobody_listens_is_one_clear_error(endpoint: str) -> None:
    with pytest.raises(LinkFailed, match=r"the link unixsock-stream/.*node.sock cannot be opened"):
        GatewayEnd("puma", endpoint, timeout=0.1)


def test_a_closed_link_says_so(node: NodeEnd, endpoint: str) -> None:
    gateway = GatewayEnd("puma", endpoint)
    gateway.close()
    with pytest.raises(RobotUnavailable, match="the link to puma is closed"):
        gateway.send(command(1))


NODE = """
import sys, time
from app.link.node_end import NodeEnd
end = NodeEnd("puma", sys.argv[1])
print("listening", flush=True)
time.sleep(60)
"""


def spawn(endpoint: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", NODE, endpoint],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "listening\n"
    return process


def end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    assert process.stdout is not None
    process.stdout.close()


def test_a_killed_node_is_noticed_at_once_and_found_again(endpoint: str) -> None:
    seen: list[bool] = []
    process = spawn(endpoint)
    try:
        with GatewayEnd("puma", endpoint, on_alive=seen.append) as gateway:
            wait_for(lambda: seen == [True], "alive")
            killed = time.monotonic()
            end(process)
            wait_for(lambda: seen == [True, False], "gone")
            # By the link itself; what merely falls silent is noticed after ten seconds.
            assert time.monotonic() - killed < 3
            assert not gateway.alive
            # The dead node left its socket file behind; the next one takes it over.
            process = spawn(endpoint)
            wait_for(lambda: seen == [True, False, True], "alive again", timeout=15)
    finally:
        end(process)


def test_the_socket_folder_is_made_private(tmp_path_factory: pytest.TempPathFactory) -> None:
    import tempfile

    with tempfile.TemporaryDirectory(prefix="fh-") as folder:
        where = Path(folder) / "link"
        node = NodeEnd("puma", socket_endpoint(where / "n.sock"))
        node.close()
        assert where.stat().st_mode & 0o777 == 0o700


def test_a_socket_folder_open_to_others_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    with pytest.raises(LinkFailed, match=r"is open to others \(mode 0755\); make it private with"):
        NodeEnd("puma", f"unixsock-stream/{tmp_path}/n.sock")


def test_sessions_find_nothing_that_was_not_named(node: NodeEnd) -> None:
    with zenoh.open(zenoh.Config()) as stranger:
        assert list(stranger.liveliness().get("farhand/**", timeout=0.5)) == []
