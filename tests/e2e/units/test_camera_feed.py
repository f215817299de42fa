"""The pictures of one robot camera, as the page takes them."""

import numpy as np
import simplejpeg
from playwright.sync_api import Page

from app.gateway.picture_pace import Shown, acknowledged
from app.link.header import FrameHeader
from tests.e2e.running import run

FEED = """
const real = window.WebSocket;
const made = [];
window.WebSocket = class {
    static OPEN = 1;
    readyState = 1;
    said = [];
    constructor() { made.push(this); }
    send(text) { this.said.push(text); }
    close() {}
};
try {
    const feed = new m.CameraFeed("wrist");
    const seen = [];
    feed.addEventListener("picture", ({ detail: { bitmap, seq } }) => {
        seen.push([seq, bitmap.width]);
        bitmap.close();
    });
    feed.open();
    const [socket] = made;
    socket.onopen();
    const answers = async (count) => {
        while (socket.said.length < count) await new Promise((go) => setTimeout(go, 5));
    };
    for (const [n, bytes] of a.entries()) {
        if (n === 1) feed.mostHz = 15;
        socket.onmessage({ data: Uint8Array.from(bytes).buffer });
        await answers(n + 1);
    }
    feed.close();
    return [seen, socket.said];
} finally {
    window.WebSocket = real;
}
"""


def test_each_picture_is_answered_with_how_many_are_wanted_also_a_broken_one(
    modules: Page,
) -> None:
    jpeg = simplejpeg.encode_jpeg(np.full((32, 48, 3), 128, np.uint8), colorspace="BGR")
    messages = [
        list(FrameHeader(number, 0.0, 0).pack() + data)
        for number, data in ((7, jpeg), (8, b"no picture"), (9, jpeg))
    ]
    seen, said = run(modules, "core/camera-feed.js", FEED, messages)
    assert seen == [[7, 48], [9, 48]]
    assert [acknowledged(text) for text in said] == [Shown(7, 30), Shown(8, 15), Shown(9, 15)]
