"""Where a request comes from, when a proxy stands in front."""

import ipaddress
import re
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from starlette.datastructures import Headers

from app.errors import NotAllowed
from app.gateway.machine import default_gateways, parse_address

Network = ipaddress.IPv4Network | ipaddress.IPv6Network

_WITH_PORT = re.compile(r"(\d+\.\d+\.\d+\.\d+|\[[0-9a-fA-F:.%]+\]):\d{1,5}")


class Proxies:
    """The proxies in front of a server.

    Args:
        addresses: Who is answered. An address that stands there by itself is a proxy that is known;
            a network, loopback and ``gateway`` say only from where a proxy may come.
    """

    def __init__(self, addresses: Sequence[Network | Literal["gateway"]]) -> None:
        named = [each for each in addresses if each != "gateway"]
        self._known = [each for each in named if each.num_addresses == 1 and not each.is_loopback]
        self._networks = named
        if len(named) < len(addresses):
            self._networks = [*named, *map(ipaddress.ip_network, default_gateways())]

    def client(self, scope: Mapping[str, Any]) -> str:
        """Where a request comes from, as the proxy says.

        The last entry of ``X-Forwarded-For`` is the proxy's own word, and those before it are
        whatever the client sent. Only the entry of a proxy that is known by its own address is
        passed over: clients may well be in the same network as a proxy.

        Raises:
            NotAllowed: it did not come through a proxy.
        """
        peer = str((scope.get("client") or ("",))[0])
        if not _is_in(peer, self._networks):
            raise NotAllowed(
                f"this server is reached through the proxy in front of it; if that is what you "
                f"are, start the server with --proxy-address {peer[:60]}".rstrip(),
                code="not_through_proxy",
            )
        forwarded = ",".join(Headers(scope=dict(scope)).getlist("x-forwarded-for")).split(",")
        for entry in reversed([_host(part) for part in forwarded if part.strip()]):
            if not _is_in(entry, self._known):
                return entry[:64]
        return peer


def _host(entry: str) -> str:
    """An entry without the port that some proxies add."""
    entry = entry.strip()
    found = _WITH_PORT.fullmatch(entry)
    return found[1].strip("[]") if found else entry


def _is_in(text: str, networks: Sequence[Network]) -> bool:
    address = parse_address(text)
    return address is not None and any(address in network for network in networks)
