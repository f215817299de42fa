"""Making and reading certificates: X.509, without any file.

An authority may certify this machine's own names, and private addresses, alone (name constraints,
RFC 5280 section 4.2.1.10, critical): whoever steals its key cannot play a bank, or the printer of
the same network, to those who trust it. Of addresses it may certify all private ones and not only
today's: a router gives out others every now and then, and each new authority would have to be
trusted by people anew, who would learn to do that without comparing.
"""

import datetime
import ipaddress
import secrets
import socket
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from app.gateway.machine import Address, Names

AUTHORITY_DAYS = 3650
LEAF_DAYS = 90
"""Browsers accept up to 398 days (CA/Browser Forum, Baseline Requirements 6.3.2)."""
BACKDATED = datetime.timedelta(days=1)
"""Valid before now, for laptops whose clock is late."""

PRIVATE_DOMAINS = ("local", "home.arpa", "internal")
"""Domains that nobody owns on the internet (RFC 6762, 8375; ICANN's .internal)."""
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


class Issued(NamedTuple):
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


def public_part(certificate: x509.Certificate) -> Public:
    """What everybody may know."""
    return Public(
        certificate.public_bytes(serialization.Encoding.PEM),
        certificate.public_bytes(serialization.Encoding.DER),
        certificate.fingerprint(hashes.SHA256()).hex(":").upper(),
    )


def make_authority(names: Names, now: datetime.datetime) -> Issued:
    """A certificate authority that may certify ``names`` and private addresses.

    Also this machine's name in the private domains, where a router may put it later.
    """
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
    short = [n for n in names.dns if "." not in n and n != "localhost"]
    own = ("localhost", *names.dns, *(f"{n}.{domain}" for n in short for domain in PRIVATE_DOMAINS))
    public = [_around(a) for a in names.addresses if not any(a in net for net in PRIVATE_NETWORKS)]
    permitted: list[x509.GeneralName] = [x509.DNSName(n) for n in dict.fromkeys(own)]
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
    return Issued(certificate, key)


def make_leaf(authority: Issued, names: Names, now: datetime.datetime) -> Issued:
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
    return Issued(certificate, key)


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


def wide_domains(authority: x509.Certificate) -> list[str]:
    """The domains of other machines that an authority made by an earlier version may certify."""
    return [name for name in constraints(authority)[0] if name in PRIVATE_DOMAINS]


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


def is_signed_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """Whether the authority's key signed the certificate."""
    try:
        certificate.verify_directly_issued_by(authority)
    except Exception:
        # InvalidSignature, or one of many errors about a key of another kind.
        return False
    return True
