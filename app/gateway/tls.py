"""HTTPS without pain: a certificate authority of this machine's own, and a certificate from it.

The authority is made once and trusted once by each browser; the server's certificate is made anew
whenever it runs out or the machine's names change, which nobody notices. Both lie in
``DATA_DIR/tls`` (0700), each with its key in one file (0600), so that a file is always whole.

The authority may certify this machine's names and private addresses alone (name constraints, RFC
5280 section 4.2.1.10, critical): whoever steals its key cannot play a bank to those who trust it.
"""

import contextlib
import datetime
import fcntl
import ipaddress
import logging
import os
import secrets
import socket
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from app.errors import CannotStart
from app.gateway.machine import Address, Names

log = logging.getLogger(__name__)

FOLDER = "tls"
AUTHORITY_FILE = "authority.pem"
SERVER_FILE = "server.pem"
AUTHORITY_DAYS = 3650
LEAF_DAYS = 90
"""Browsers accept up to 398 days (CA/Browser Forum, Baseline Requirements 6.3.2)."""
RENEW_DAYS = 30
"""Made anew when it has fewer days left."""
BACKDATED = datetime.timedelta(days=1)
"""Valid before now, for laptops whose clock is late."""

PRIVATE_DOMAINS = ("localhost", "local", "home.arpa", "internal")
"""Names that nobody owns on the internet (RFC 6761, 6762, 8375; ICANN's .internal)."""
PRIVATE_NETWORKS = tuple(
    ipaddress.ip_network(text)
    for text in (
        "127.0.0.0/8", "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16",
        "100.64.0.0/10", "::1/128", "fc00::/7", "fe80::/10",
    )
)  # fmt: skip


class Public(NamedTuple):
    """What everybody may know of an authority."""

    pem: bytes
    der: bytes
    fingerprint: str
    """SHA-256 of the certificate, as browsers show it."""


class _Issued(NamedTuple):
    """A certificate and its key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def pem(self) -> bytes:
        """Both in one file."""
        key = self.key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
        return key + self.certificate.public_bytes(serialization.Encoding.PEM)


class LocalAuthority:
    """The authority of one data folder, and the certificate that it gave the server.

    Args:
        folder: ``DATA_DIR/tls``.
        names: Asked each time for what the machine is called now.
        now: The time in UTC.
    """

    def __init__(
        self,
        folder: Path,
        names: Callable[[], Names],
        now: Callable[[], datetime.datetime] = lambda: datetime.datetime.now(datetime.UTC),
    ) -> None:
        self._folder = folder
        self._ask_names = names
        self._now = now
        self._left_out: frozenset[str] = frozenset()
        self.server_file = folder / SERVER_FILE
        self.names = Names((), ())
        """What the server's certificate holds."""
        self.public = Public(b"", b"", "")

    def prepare(self) -> bool:
        """Make what is missing, has run out or fits no more; say whether the server's changed.

        Raises:
            CannotStart: the folder is open to others, or cannot be read or written.
        """
        try:
            with self._locked():
                authority = self._authority()
                return self._serve_by(authority)
        except (OSError, ValueError) as error:
            raise CannotStart(
                f"the certificates in {self._folder} cannot be used ({error}); delete the folder "
                "to have new ones made, or give --tls-cert and --tls-key",
                path=str(self._folder),
            ) from error

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        """One process at a time: of two servers that start at once, both use the same."""
        self._folder.parent.mkdir(parents=True, exist_ok=True)
        self._folder.mkdir(mode=0o700, exist_ok=True)
        check_private(self._folder)
        handle = os.open(self._folder / "lock", os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)

    def _authority(self) -> _Issued:
        path = self._folder / AUTHORITY_FILE
        issued = _read(path)
        if issued is None or self._days_left(issued.certificate) < RENEW_DAYS:
            issued = make_authority(self._ask_names(), self._now())
            _write(path, issued.pem())
            log.info("made a certificate authority for this machine in %s", self._folder)
        self.public = _public(issued.certificate)
        return issued

    def _serve_by(self, authority: _Issued) -> bool:
        wanted = self._permitted(authority.certificate, self._ask_names())
        issued = _read(self.server_file)
        fits = (
            issued is not None
            and issued.certificate.issuer == authority.certificate.subject
            and _is_signed_by(issued.certificate, authority.certificate)
            and self._days_left(issued.certificate) >= RENEW_DAYS
            and certified_names(issued.certificate) == wanted
        )
        changed = not fits or wanted != self.names
        if not fits:
            _write(self.server_file, make_leaf(authority, wanted, self._now()).pem())
            log.info("made a certificate for %s", ", ".join(wanted.hosts()))
        self.names = wanted
        return changed

    def _permitted(self, authority: x509.Certificate, names: Names) -> Names:
        """The part of ``names`` that the authority may certify; the rest is told once."""
        dns, networks = constraints(authority)
        permitted = Names(
            tuple(n for n in names.dns if any(n == d or n.endswith(f".{d}") for d in dns)),
            tuple(a for a in names.addresses if any(a in network for network in networks)),
        )
        left_out = frozenset(names.hosts()) - frozenset(permitted.hosts())
        if left_out and left_out != self._left_out:
            # A new authority would have to be trusted anew everywhere; only a person decides that.
            log.warning(
                "%s: not certified, since new or public; to have it certified delete %s, start "
                "again, and let the browsers trust the new authority",
                ", ".join(sorted(left_out)),
                self._folder,
            )
        self._left_out = left_out
        return permitted

    def _days_left(self, certificate: x509.Certificate) -> float:
        return (certificate.not_valid_after_utc - self._now()) / datetime.timedelta(days=1)


def read_authority(folder: Path) -> Public | None:
    """The authority of a data folder, or None when none was made.

    Raises:
        CannotStart: its files are open to others, or cannot be read.
    """
    try:
        issued = _read(folder / AUTHORITY_FILE)
    except (OSError, ValueError) as error:
        raise CannotStart(
            f"the authority in {folder} cannot be read: {error}", path=str(folder)
        ) from error
    return None if issued is None else _public(issued.certificate)


def _public(certificate: x509.Certificate) -> Public:
    return Public(
        certificate.public_bytes(serialization.Encoding.PEM),
        certificate.public_bytes(serialization.Encoding.DER),
        certificate.fingerprint(hashes.SHA256()).hex(":").upper(),
    )


def check_private(path: Path) -> None:
    """Refuse a file or folder that others than its owner may read or write.

    Raises:
        CannotStart: with what to do about it.
    """
    found = path.stat()
    if found.st_uid != os.geteuid() or stat.S_IMODE(found.st_mode) & 0o077:
        raise CannotStart(
            f"{path} holds secret keys and is open to others than the user who runs this server; "
            f"close it (chmod go-rwx {path}), or delete it to have new ones made",
            path=str(path),
        )


def make_authority(names: Names, now: datetime.datetime) -> _Issued:
    """A certificate authority that may certify ``names``, private names and private addresses."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name(
        [
            x509.NameAttribute(NameOID.ORGANIZATION_NAME, "Farhand"),
            # The serial tells two authorities of one machine apart in a browser's list.
            x509.NameAttribute(
                NameOID.COMMON_NAME,
                f"Farhand on {socket.gethostname()[:30]} ({secrets.token_hex(3)})",
            ),
        ]
    )
    own = [n for n in names.dns if not _is_below(n, PRIVATE_DOMAINS)]
    public = [_around(a) for a in names.addresses if not any(a in net for net in PRIVATE_NETWORKS)]
    permitted: list[x509.GeneralName] = [x509.DNSName(n) for n in (*PRIVATE_DOMAINS, *own)]
    permitted += [x509.IPAddress(n) for n in (*PRIVATE_NETWORKS, *dict.fromkeys(public))]
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - BACKDATED)
        .not_valid_after(now + datetime.timedelta(days=AUTHORITY_DAYS))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(authority=True), critical=True)
        .add_extension(x509.NameConstraints(permitted, None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return _Issued(certificate, key)


def make_leaf(authority: _Issued, names: Names, now: datetime.datetime) -> _Issued:
    """A server certificate for ``names``, with a new key."""
    key = ec.generate_private_key(ec.SECP256R1())
    general: list[x509.GeneralName] = [x509.DNSName(name) for name in names.dns]
    general += [x509.IPAddress(address) for address in names.addresses]
    identifier = x509.SubjectKeyIdentifier.from_public_key(authority.key.public_key())
    certificate = (
        x509.CertificateBuilder()
        .subject_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Farhand")]))
        .issuer_name(authority.certificate.subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - BACKDATED)
        .not_valid_after(now + datetime.timedelta(days=LEAF_DAYS))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(authority=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectAlternativeName(general), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(identifier),
            critical=False,
        )
        .sign(authority.key, hashes.SHA256())
    )
    return _Issued(certificate, key)


def certified_names(certificate: x509.Certificate) -> Names:
    """What a certificate is for."""
    general = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    addresses = general.get_values_for_type(x509.IPAddress)
    return Names(
        tuple(general.get_values_for_type(x509.DNSName)),
        tuple(a for a in addresses if isinstance(a, Address)),
    )


def constraints(
    authority: x509.Certificate,
) -> tuple[list[str], list[ipaddress.IPv4Network | ipaddress.IPv6Network]]:
    """Domains and networks that an authority may certify."""
    extension = authority.extensions.get_extension_for_class(x509.NameConstraints)
    permitted = extension.value.permitted_subtrees or []
    networks = [n.value for n in permitted if isinstance(n, x509.IPAddress)]
    return (
        [n.value for n in permitted if isinstance(n, x509.DNSName)],
        [n for n in networks if isinstance(n, ipaddress.IPv4Network | ipaddress.IPv6Network)],
    )


def _is_below(name: str, domains: tuple[str, ...]) -> bool:
    return any(name == domain or name.endswith(f".{domain}") for domain in domains)


def _around(address: Address) -> ipaddress.IPv4Network | ipaddress.IPv6Network:
    """A public address; in IPv6 with its neighbours, since the last half changes by itself."""
    bits = 64 if address.version == 6 else 32
    return ipaddress.ip_network(f"{address}/{bits}", strict=False)


def _usage(*, authority: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not authority,
        key_cert_sign=authority,
        crl_sign=authority,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _is_signed_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    try:
        certificate.verify_directly_issued_by(authority)
    except Exception:
        # InvalidSignature, or one of many errors about a key of another kind.
        return False
    return True


def _read(path: Path) -> _Issued | None:
    """What a file holds, or None when there is none.

    Raises:
        CannotStart: it is open to others.
        ValueError: it is not a key and a certificate.
    """
    try:
        check_private(path)
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    key = serialization.load_pem_private_key(data, None)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError(f"{path.name} holds a key of another kind")
    return _Issued(x509.load_pem_x509_certificate(data), key)


def _write(path: Path, data: bytes) -> None:
    """Replace a file as a whole; from its first byte on nobody else may read it."""
    temporary = path.with_suffix(".new")
    with contextlib.suppress(FileNotFoundError):
        temporary.unlink()
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(handle, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)
