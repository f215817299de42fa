"""How the server is reached: in the clear on loopback or behind a proxy, else over HTTPS."""

import asyncio
import logging
import ssl

from app.config import Settings
from app.errors import CannotStart
from app.gateway.machine import machine_names
from app.gateway.origin import is_loopback
from app.gateway.roles import ROUTES
from app.gateway.tls import FOLDER, LocalAuthority

log = logging.getLogger(__name__)

CERTIFICATE_CHECK_S = 60.0


def check_transport(settings: Settings) -> None:
    """Refuse half or broken certificates, and settings of a proxy without a proxy.

    Raises:
        CannotStart: with what to give instead.
    """
    cert, key = settings.tls_cert, settings.tls_key
    if (cert is None) != (key is None):
        raise CannotStart("HTTPS needs both --tls-cert and --tls-key")
    if settings.root_path and not settings.behind_proxy:
        raise CannotStart("--root-path is for a server behind a proxy: give --behind-proxy, too")
    first = settings.root_path.strip("/").partition("/")[0]
    if first and any(path.split("/")[1] == first for path in (k.split(" ")[1] for k in ROUTES)):
        raise CannotStart(f"--root-path may not begin with /{first}, which Farhand uses itself")
    if cert is None:
        return
    assert key is not None
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(cert, key)
    except (OSError, ssl.SSLError) as error:
        raise CannotStart(
            f"the certificate {cert} with the key {key} cannot be used: {error}"
        ) from error


def local_authority(settings: Settings) -> LocalAuthority | None:
    """What makes the certificates of a server that other machines reach and that has none.

    Raises:
        CannotStart: its folder is open to others, or cannot be read or written.
    """
    if settings.tls_cert is not None or settings.behind_proxy or is_loopback(settings.host):
        return None
    more = (settings.host, *settings.gateway.allowed_hosts)
    authority = LocalAuthority(settings.data_dir / FOLDER, lambda: machine_names(more))
    authority.prepare()
    return authority


async def keep_certificate(
    context: ssl.SSLContext, settings: Settings, authority: LocalAuthority | None
) -> None:
    """Renew the certificate, or read again the one that was given, for ever.

    Connections that are open keep theirs; new ones get the new one.
    """
    seen = _stamp(settings)
    while True:
        await asyncio.sleep(CERTIFICATE_CHECK_S)
        try:
            if authority is not None:
                if await asyncio.to_thread(authority.prepare):
                    context.load_cert_chain(authority.server_file)
            elif settings.tls_cert is not None and (now := _stamp(settings)) != seen:
                context.load_cert_chain(settings.tls_cert, settings.tls_key)
                seen = now
                log.info("read the certificate %s again", settings.tls_cert)
        except (CannotStart, OSError, ssl.SSLError) as error:
            log.error("the certificate stays as it is: %s", error)


def _stamp(settings: Settings) -> tuple[int, ...]:
    """Changes when the certificate that was given does."""
    files = [path for path in (settings.tls_cert, settings.tls_key) if path is not None]
    try:
        return tuple(path.stat().st_mtime_ns for path in files)
    except OSError:
        return ()
