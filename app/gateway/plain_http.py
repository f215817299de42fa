"""What the HTTPS listener says to plain HTTP: that this is HTTPS, and where.

Closed without a word, a browser in which somebody types the address without ``https://`` shows
nothing but "connection reset".
"""

import asyncio
import contextlib
import re
import socket

MAX_HEAD = 4096
_HOST = re.compile(rb"\r\nhost:[ \t]*([a-z0-9.:\[\]-]{1,255})[ \t]*\r\n", re.IGNORECASE)


async def send_away(connection: socket.socket) -> None:
    """Say in plain HTTP that this is HTTPS, and where. Nothing of what was asked is looked at."""
    loop = asyncio.get_running_loop()
    head = b""
    while b"\r\n\r\n" not in head and len(head) < MAX_HEAD:
        part = await loop.sock_recv(connection, MAX_HEAD)
        if not part:
            return
        head += part
    found = _HOST.search(head.partition(b"\r\n\r\n")[0] + b"\r\n")
    place = f"https://{found[1].decode()}/" if found else "https:// and this address"
    told = f'<a href="{place}">{place}</a>' if found else place
    body = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>Farhand: HTTPS</title>'
        f"<h1>This server speaks HTTPS alone</h1><p>Open {told}</p></html>\n"
    ).encode()
    answer = (
        b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html; charset=utf-8\r\n"
        b"Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n"
        b"Cache-Control: no-store\r\nConnection: close\r\n"
        b"Content-Length: %d\r\n\r\n" % len(body)
    )
    await loop.sock_sendall(connection, answer + body)
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
