"""HTTPS without pain: a certificate authority of this machine's own, and a certificate from it.

The authority is made once and trusted once by each browser; the server's certificate is made anew
whenever it runs out or the machine's names change, which nobody notices. Both lie in
``DATA_DIR/tls`` (0700), each with its key in one file (0600), so that a file is always whole. What
they hold is made in :mod:`app.gateway.certificates`.
"""

import contextlib
import datetime
import fcntl
import logging
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from app.errors import CannotStart
from app.gateway.certificates import (
    Issued,
    Public,
    certified_names,
    constraints,
    is_signed_by,
    make_authority,
    make_leaf,
    public_part,
    wide_domains,
)
from app.gateway.machine import Names

log = logging.getLogger(__name__)

FOLDER = "tls"
AUTHORITY_FILE = "authority.pem"
SERVER_FILE = "server.pem"
RENEW_DAYS = 30
"""Made anew when it has fewer days left."""


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
        self._told_wide = False
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

    def _authority(self) -> Issued:
        path = self._folder / AUTHORITY_FILE
        issued = _read(path)
        if issued is None or self._days_left(issued.certificate) < RENEW_DAYS:
            issued = make_authority(self._ask_names(), self._now())
            _write(path, issued.pem())
            log.info("made a certificate authority for this machine in %s", self._folder)
        self.public = public_part(issued.certificate)
        if (wide := wide_domains(issued.certificate)) and not self._told_wide:
            # It was trusted as it is; only a person decides to have another one trusted.
            self._told_wide = True
            log.warning(
                "the authority in %s was made by an earlier version and may certify every name "
                "below %s; to have one for this machine's names alone delete the folder, start "
                "again, and let the browsers trust the new authority in place of the old one",
                self._folder,
                ", ".join(wide),
            )
        return issued

    def _serve_by(self, authority: Issued) -> bool:
        wanted = self._permitted(authority.certificate, self._ask_names())
        issued = _read(self.server_file)
        fits = (
            issued is not None
            and issued.certificate.issuer == authority.certificate.subject
            and is_signed_by(issued.certificate, authority.certificate)
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
    return None if issued is None else public_part(issued.certificate)


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


def _read(path: Path) -> Issued | None:
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
    return Issued(x509.load_pem_x509_certificate(data), key)


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
