"""What this machine is called: the names and addresses under which browsers may reach it."""

import ipaddress
import re
import socket
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import psutil

Address = ipaddress.IPv4Address | ipaddress.IPv6Address

LOOPBACK = (ipaddress.ip_address("127.0.0.1"), ipaddress.ip_address("::1"))
_LABEL = r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?"
_NAME = re.compile(rf"(?=.{{1,253}}$){_LABEL}(\.{_LABEL})*")


class Names(NamedTuple):
    """Names and addresses, each sorted and once."""

    dns: tuple[str, ...]
    addresses: tuple[Address, ...]

    def hosts(self) -> tuple[str, ...]:
        """All of them as they stand in a ``Host`` header, without brackets."""
        return (*self.dns, *(str(address) for address in self.addresses))


def parse_address(text: str) -> Address | None:
    """The address that ``text`` is, an IPv4 address inside of IPv6 as itself; None for a name."""
    try:
        address = ipaddress.ip_address(text.partition("%")[0].strip("[]"))
    except ValueError:
        return None
    mapped = getattr(address, "ipv4_mapped", None)
    return mapped if isinstance(mapped, ipaddress.IPv4Address) else address


@lru_cache(4096)
def address_group(text: str) -> str:
    """An address as limits count it: of IPv6 the /64, which is what one customer is given."""
    address = parse_address(text)
    if isinstance(address, ipaddress.IPv6Address):
        return str(ipaddress.ip_network((address, 64), strict=False))
    return text[:64] if address is None else str(address)


def interface_addresses() -> frozenset[Address]:
    """Addresses of all interfaces; not link-local IPv6, which browsers cannot be sent to."""
    found = set(LOOPBACK)
    for entries in psutil.net_if_addrs().values():
        for entry in entries:
            if entry.family in (socket.AF_INET, socket.AF_INET6):
                address = parse_address(entry.address)
                if address is None or address.is_unspecified or address.is_multicast:
                    continue
                if address.version == 6 and address.is_link_local:
                    continue
                found.add(address)
    return frozenset(found)


def default_gateways(table: Path = Path("/proc/net/route")) -> tuple[Address, ...]:
    """Where this machine sends what is for elsewhere (IPv4); in a container, its host.

    Empty where the system has no such table.
    """
    try:
        rows = [line.split() for line in table.read_text().splitlines()[1:]]
    except OSError:
        return ()
    found = (row[2] for row in rows if len(row) > 2 and row[1] == "00000000" != row[2])
    # In the byte order of the machine, which is the lowest byte first wherever Farhand runs.
    return tuple(ipaddress.IPv4Address(bytes.fromhex(each)[::-1]) for each in found)


def host_names() -> frozenset[str]:
    """The machine's name: alone, with its domain if it has one, and as mDNS has it.

    May wait for a name server.
    """
    name = socket.gethostname().lower()
    names = {"localhost", name, socket.getfqdn().lower().rstrip(".")}
    if "." not in name:
        names.add(f"{name}.local")
    return frozenset(names)


def machine_names(extra: Iterable[str] = ()) -> Names:
    """All names and addresses of this machine, and those of ``extra``.

    What no certificate can hold (a name with an underscore) is left out.
    """
    dns, addresses = set(host_names()), set(interface_addresses())
    for host in extra:
        address = parse_address(host)
        if address is None:
            dns.add(host.lower())
        elif not address.is_unspecified:
            addresses.add(address)
    return Names(
        tuple(sorted(name for name in dns if _NAME.fullmatch(name))),
        tuple(sorted(addresses, key=lambda address: (address.version, int(address)))),
    )
