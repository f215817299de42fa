"""A socket that opens itself again."""

from playwright.sync_api import Page

from tests.e2e.running import run

FAKE_SOCKETS = """
const real = window.WebSocket;
const made = [];
window.WebSocket = class {
    static OPEN = 1;
    constructor() { this.readyState = 0; made.push(this); }
    close() { this.closed = true; }
    opened() { this.readyState = 1; this.onopen(); }
};
const socket = new m.ReconnectingSocket("ws://nowhere/");
const waits = [];
socket.addEventListener("state", ({ detail }) => {
    if (detail.state === "waiting") waits.push(detail.retryAt - performance.now());
});
const newest = () => made[made.length - 1];
"""


def test_a_socket_waits_longer_by_half_each_time_and_tries_at_once_when_the_network_is_back(
    modules: Page,
) -> None:
    script = """
    try {
        socket.open();
        for (let n = 0; n < 3; n += 1) {
            newest().onclose({ code: 1006 });
            await new Promise((go) => setTimeout(go, waits[n] + 30));
        }
        const tried = made.length;
        // "connecting", without a network: this try may hang for long
        window.dispatchEvent(new Event("online"));
        const again = made.length - tried;
        newest().opened();
        window.dispatchEvent(new Event("online"));
        socket.retryNow(); // open, and heard a moment ago
        const left = made.length - tried - again;
        socket.close();
        window.dispatchEvent(new Event("online"));
        return { waits, tried, again, left, after: made.length, gone: made.at(-2).closed };
    } finally {
        window.WebSocket = real;
    }
    """
    found = run(modules, "core/socket.js", FAKE_SOCKETS + script)
    for wait, middle in zip(found["waits"], (250, 375, 562.5), strict=True):
        assert 0.75 * middle < wait < 1.25 * middle
    assert (found["tried"], found["again"], found["left"], found["after"]) == (4, 1, 0, 5)
    assert found["gone"]


def test_an_open_socket_that_was_silent_is_tried_anew_when_asked(modules: Page) -> None:
    script = """
    const clock = performance.now.bind(performance);
    try {
        socket.open();
        newest().opened();
        performance.now = () => clock() + 2100;
        socket.retryNow();
        const tried = made.length;
        socket.close();
        return tried;
    } finally {
        performance.now = clock;
        window.WebSocket = real;
    }
    """
    assert run(modules, "core/socket.js", FAKE_SOCKETS + script) == 2
