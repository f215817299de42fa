"""Where a request comes from behind a proxy: what a client says of itself is never believed."""

from collections.abc import Sequence
from ipaddress import ip_network
from pathlib import Path
from typing import Any

import pytest

from app.config import Settings
from app.errors import NotAllowed
from app.gateway.forwarded import Proxies
from app.gateway.machine import default_gateways

PRIVATE = tuple(map(ip_network, ("127.0.0.0/8", "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16")))


def scope(peer: str, *forwarded: str) -> dict[str, Any]:
    fields = [(b"x-forwarded-for", value.encode()) for value in forwarded]
    return {"client": (peer, 1), "headers": fields}


@pytest.mark.parametrize(
    "claimed", [("203.0.113.7",), ("10.1.2.3",), ("127.0.0.1", "8.8.8.8"), ("nonsense",), ("",)]
)
def test_a_client_of_the_proxys_own_network_cannot_choose_where_it_comes_from(
    claimed: Sequence[str],
) -> None:
    proxies = Proxies(PRIVATE)
    asked = scope("172.17.0.1", *claimed, "192.168.1.50")
    assert proxies.client(asked) == "192.168.1.50"
    joined = scope("172.17.0.1", ", ".join([*claimed, "192.168.1.50"]))
    assert proxies.client(joined) == "192.168.1.50"


def test_somebody_at_the_proxys_own_machine_cannot_either() -> None:
    proxies = Proxies((ip_network("127.0.0.0/8"), ip_network("::1/128")))
    for own in ("127.0.0.1", "::1"):
        assert proxies.client(scope("127.0.0.1", "203.0.113.7", own)) == own


def test_a_proxy_that_is_named_by_itself_is_passed_over() -> None:
    proxies = Proxies((*PRIVATE, ip_network("172.18.0.4")))
    assert proxies.client(scope("172.17.0.1", "203.0.113.9, 172.18.0.4")) == "203.0.113.9"
    assert proxies.client(scope("172.17.0.1", "203.0.113.9, 172.18.0.5")) == "172.18.0.5"


@pytest.mark.parametrize(
    ("entry", "client"),
    [
        ("203.0.113.9:51000", "203.0.113.9"),
        ("[2001:db8::7]:51000", "2001:db8::7"),
        ("[2001:db8::7]", "[2001:db8::7]"),
        ("2001:db8::7", "2001:db8::7"),
    ],
)
def test_a_port_is_no_part_of_an_address(entry: str, client: str) -> None:
    # Else every connection would be somebody new.
    assert Proxies(PRIVATE).client(scope("127.0.0.1", entry)) == client


TABLE = """Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT
eth0\t00000000\t010011AC\t0003\t0\t0\t0\t00000000\t0\t0\t0
eth0\t000011AC\t00000000\t0001\t0\t0\t0\t0000FFFF\t0\t0\t0
"""


def test_a_containers_gateway_is_its_host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = tmp_path / "route"
    table.write_text(TABLE)
    gateways = default_gateways(table)
    assert [str(each) for each in gateways] == ["172.17.0.1"]
    assert default_gateways(tmp_path / "none") == ()
    monkeypatch.setattr("app.gateway.forwarded.default_gateways", lambda: gateways)
    proxies = Proxies((ip_network("127.0.0.0/8"), "gateway"))
    assert proxies.client(scope("172.17.0.1", "203.0.113.9")) == "203.0.113.9"
    assert proxies.client(scope("172.17.0.1", "203.0.113.9", "172.17.0.1")) == "172.17.0.1"
    for stranger in ("172.17.0.2", "192.168.1.5", "10.0.0.1"):
        with pytest.raises(NotAllowed, match=f"--proxy-address {stranger}"):
            proxies.client(scope(stranger, "203.0.113.9"))


def test_the_image_answers_its_host_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    dockerfile = (Path(__file__).parents[2] / "Dockerfile").read_text()
    value = dockerfile.partition("FARHAND_PROXY_ADDRESSES='")[2].partition("'")[0]
    monkeypatch.setenv("FARHAND_PROXY_ADDRESSES", value)
    given = Settings().proxy_addresses
    assert given == (ip_network("127.0.0.0/8"), ip_network("::1/128"), "gateway")
