"""The authority and its certificates, judged by a real handshake."""

import datetime
import ipaddress
import logging
import socket
import ssl
import stat
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization

from app.errors import CannotStart
from app.gateway.certificates import certified_names, make_authority, make_leaf
from app.gateway.machine import Names, host_names, interface_addresses, machine_names
from app.gateway.tls import AUTHORITY_FILE, SERVER_FILE, LocalAuthority, read_authority

DAY = datetime.timedelta(days=1)
HERE = Names(
    ("arm", "arm.local", "localhost"),
    tuple(ipaddress.ip_address(a) for a in ("127.0.0.1", "192.168.1.5", "::1")),
)


class Machine:
    """A machine whose names and clock can be set."""

    def __init__(self, folder: Path) -> None:
        self.names = HERE
        self.now = datetime.datetime.now(datetime.UTC)
        self.folder = folder / "data" / "tls"

    def authority(self) -> LocalAuthority:
        return LocalAuthority(self.folder, lambda: self.names, lambda: self.now)

    def certificate(self) -> x509.Certificate:
        return x509.load_pem_x509_certificate((self.folder / SERVER_FILE).read_bytes())


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def handshake(context: ssl.SSLContext, trusted: bytes, host: str) -> str | None:
    """Connect by ``host``, trusting one authority; why it failed, or None."""
    trust = ssl.create_default_context(cadata=trusted.decode())
    trust.verify_flags |= ssl.VERIFY_X509_STRICT
    near, far = socket.socketpair()

    def serve() -> None:
        try:
            with context.wrap_socket(far, server_side=True) as connection:
                connection.recv(1)
        except OSError:
            far.close()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        with trust.wrap_socket(near, server_hostname=host):
            return None
    except ssl.SSLError as error:
        return str(error)
    finally:
        near.close()
        thread.join()


def server_context(file: Path) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(file)
    return context


def test_a_browser_that_trusts_the_authority_connects_by_every_name(machine: Machine) -> None:
    authority = machine.authority()
    assert authority.prepare() is True
    context = server_context(authority.server_file)
    for host in HERE.hosts():
        assert handshake(context, authority.public.pem, host) is None, host
    for foreign in ("evil.example", "192.168.1.6"):
        assert "mismatch" in (handshake(context, authority.public.pem, foreign) or "")
    # Another authority's word does not count.
    other = Machine(machine.folder / "other").authority()
    other.prepare()
    assert "verify failed" in (handshake(context, other.public.pem, "arm") or "")


def test_a_stolen_authority_cannot_play_somebody_else(machine: Machine, tmp_path: Path) -> None:
    stolen = make_authority(HERE, machine.now)
    bank = Names(("bank.example",), (ipaddress.ip_address("203.0.113.9"),))
    for names, host in ((bank, "bank.example"), (bank, "203.0.113.9")):
        file = tmp_path / "forged.pem"
        file.write_bytes(make_leaf(stolen, names, machine.now).pem())
        pem = stolen.certificate.public_bytes(serialization.Encoding.PEM)
        assert "permitted subtree violation" in (handshake(server_context(file), pem, host) or "")


@pytest.mark.parametrize(
    "name", ["printer.local", "router.home.arpa", "db.internal", "local", "other", "a.example"]
)
def test_a_stolen_authority_cannot_play_another_machine(
    machine: Machine, tmp_path: Path, name: str
) -> None:
    stolen = make_authority(HERE, machine.now)
    file = tmp_path / "forged.pem"
    file.write_bytes(make_leaf(stolen, Names((name,), ()), machine.now).pem())
    pem = stolen.certificate.public_bytes(serialization.Encoding.PEM)
    assert "permitted subtree violation" in (handshake(server_context(file), pem, name) or "")


def test_a_router_may_give_the_machine_another_address_and_a_domain(machine: Machine) -> None:
    machine.authority().prepare()
    trusted = (machine.folder / AUTHORITY_FILE).read_bytes()
    names = (*HERE.dns, "arm.home.arpa", "arm.internal")
    machine.names = Names(names, (ipaddress.ip_address("10.9.8.7"),))
    authority = machine.authority()
    assert authority.prepare() is True
    assert (machine.folder / AUTHORITY_FILE).read_bytes() == trusted
    for host in machine.names.hosts():
        context = server_context(authority.server_file)
        assert handshake(context, authority.public.pem, host) is None, host


def test_an_authority_of_an_earlier_version_is_kept_and_told(
    machine: Machine, caplog: pytest.LogCaptureFixture
) -> None:
    wide = Names((*HERE.dns, "local", "internal"), HERE.addresses)
    machine.names = wide
    machine.authority().prepare()
    trusted = (machine.folder / AUTHORITY_FILE).read_bytes()
    machine.names = HERE
    caplog.clear()
    again = machine.authority()
    with caplog.at_level(logging.WARNING):
        again.prepare()
        again.prepare()
    assert (machine.folder / AUTHORITY_FILE).read_bytes() == trusted
    told = [each for each in caplog.messages if "every name below local, internal" in each]
    assert len(told) == 1
    assert "delete the folder" in told[0]


def test_keys_are_for_their_owner_alone(machine: Machine) -> None:
    machine.authority().prepare()
    assert stat.S_IMODE(machine.folder.stat().st_mode) == 0o700
    for path in machine.folder.iterdir():
        assert stat.S_IMODE(path.stat().st_mode) == 0o600, path


@pytest.mark.parametrize("name", [".", AUTHORITY_FILE, SERVER_FILE])
def test_keys_open_to_others_are_refused(machine: Machine, name: str) -> None:
    machine.authority().prepare()
    path = machine.folder / name
    path.chmod(path.stat().st_mode | 0o040)
    with pytest.raises(CannotStart, match=r"open to others.*chmod go-rwx"):
        machine.authority().prepare()


def test_a_second_start_makes_nothing(machine: Machine) -> None:
    first = machine.authority()
    first.prepare()
    before = {path.name: path.read_bytes() for path in machine.folder.iterdir()}
    again = machine.authority()
    again.prepare()
    assert again.prepare() is False
    assert {path.name: path.read_bytes() for path in machine.folder.iterdir()} == before
    assert again.public == first.public == read_authority(machine.folder)
    assert len(first.public.fingerprint.split(":")) == 32


def test_the_certificate_is_renewed_in_time_by_the_same_authority(machine: Machine) -> None:
    authority = machine.authority()
    authority.prepare()
    before = machine.certificate()
    assert before.not_valid_after_utc - before.not_valid_before_utc <= 398 * DAY
    assert before.not_valid_before_utc < machine.now - DAY / 2
    machine.now += 59 * DAY
    assert authority.prepare() is False
    machine.now += 2 * DAY
    fingerprint = authority.public.fingerprint
    assert authority.prepare() is True
    after = machine.certificate()
    assert after.not_valid_after_utc - machine.now > 89 * DAY
    assert after.public_key() != before.public_key()
    assert authority.public.fingerprint == fingerprint


def test_new_names_and_addresses_are_certified(machine: Machine) -> None:
    authority = machine.authority()
    authority.prepare()
    moved = Names(
        ("arm", "localhost", "arm.internal"),
        (ipaddress.ip_address("127.0.0.1"), ipaddress.ip_address("10.1.2.3")),
    )
    machine.names = moved
    assert authority.prepare() is True
    assert certified_names(machine.certificate()) == authority.names == moved
    context = server_context(authority.server_file)
    assert handshake(context, authority.public.pem, "10.1.2.3") is None


def test_a_running_server_takes_the_new_certificate(machine: Machine) -> None:
    authority = machine.authority()
    authority.prepare()
    context = server_context(authority.server_file)
    machine.names = Names(("new.arm.local",), ())
    assert authority.prepare()
    assert handshake(context, authority.public.pem, "new.arm.local") is not None
    context.load_cert_chain(authority.server_file)
    assert handshake(context, authority.public.pem, "new.arm.local") is None


def test_what_the_authority_may_not_certify_is_left_out_and_told_once(
    machine: Machine, caplog: pytest.LogCaptureFixture
) -> None:
    authority = machine.authority()
    authority.prepare()
    fingerprint = authority.public.fingerprint
    public = ipaddress.ip_address("203.0.113.9")
    machine.names = Names((*HERE.dns, "renamed"), (*HERE.addresses, public))
    with caplog.at_level(logging.WARNING):
        assert authority.prepare() is False
        assert authority.prepare() is False
    assert authority.names == HERE
    assert authority.public.fingerprint == fingerprint
    assert [r.getMessage() for r in caplog.records if "203.0.113.9, renamed" in r.getMessage()]
    assert len(caplog.records) == 1


def test_public_addresses_of_the_first_start_are_certified(machine: Machine) -> None:
    four, six = (ipaddress.ip_address(a) for a in ("203.0.113.9", "2001:db8:1:2::5"))
    machine.names = Names(("vps.example.org",), (four, six))
    authority = machine.authority()
    authority.prepare()
    assert authority.names == machine.names
    # The last half of an address of IPv6 changes by itself.
    machine.names = Names(("vps.example.org",), (ipaddress.ip_address("2001:db8:1:2::99"),))
    assert authority.prepare() is True
    assert authority.names == machine.names
    machine.names = Names((), (ipaddress.ip_address("2001:db8:1:3::1"),))
    authority.prepare()
    assert authority.names == Names((), ())


@pytest.mark.parametrize("name", [AUTHORITY_FILE, SERVER_FILE])
def test_a_damaged_file_is_one_clear_error(machine: Machine, name: str) -> None:
    machine.authority().prepare()
    (machine.folder / name).write_text("nonsense")
    with pytest.raises(CannotStart, match="delete the folder to have new ones made"):
        machine.authority().prepare()


def test_a_certificate_of_a_lost_authority_is_made_anew(machine: Machine) -> None:
    machine.authority().prepare()
    (machine.folder / AUTHORITY_FILE).unlink()
    authority = machine.authority()
    assert authority.prepare() is True
    context = server_context(authority.server_file)
    assert handshake(context, authority.public.pem, "arm") is None


def test_of_several_that_start_at_once_all_use_one(machine: Machine) -> None:
    authorities = [machine.authority() for _ in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(LocalAuthority.prepare, authorities))
    assert len({authority.public for authority in authorities}) == 1


def test_this_machine_has_names_and_addresses() -> None:
    assert {"localhost", socket.gethostname().lower()} <= host_names()
    assert {ipaddress.ip_address("127.0.0.1"), ipaddress.ip_address("::1")} <= (
        interface_addresses()
    )
    names = machine_names(["Arm.Example", "bad_name", "[fd00::7%eth0]", "0.0.0.0", "a..b"])
    assert "arm.example" in names.dns
    assert ipaddress.ip_address("fd00::7") in names.addresses
    assert not {"bad_name", "a..b", "0.0.0.0"} & set(names.hosts())
    assert names.dns == tuple(sorted(set(names.dns)))
