"""How to make a browser trust this server: the page, and the authority's certificate."""

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, Response

from app.errors import NotFound
from app.gateway.pages import page
from app.gateway.tls import LocalAuthority

router = APIRouter(include_in_schema=False)

_SYSTEMS = {
    "windows": (
        "Windows (Edge, Chrome)",
        "Download <a href='{p}ca.crt'>the certificate</a> and open it.",
        "Press <b>Install certificate</b>, choose <b>Current user</b>.",
        "Choose <b>Place all certificates in the following store</b>, <b>Browse</b>, <b>Trusted "
        "root certification authorities</b>.",
        "Windows shows the fingerprint once more; confirm, and start the browser again.",
    ),
    "mac": (
        "macOS (Safari, Chrome)",
        "Download <a href='{p}ca.crt'>the certificate</a> and open it: the keychain opens.",
        "Put it into the keychain <b>login</b>, then open it there by a double click.",
        "Under <b>Trust</b> choose <b>Always trust</b> for <b>Secure Sockets Layer (SSL)</b>, and "
        "close the window.",
    ),
    "ios": (
        "iPhone and iPad",
        "Open this page in Safari and download <a href='{p}ca.crt'>the certificate</a>; allow it.",
        "<b>Settings</b>, <b>Profile downloaded</b>: install it.",
        "<b>Settings</b>, <b>General</b>, <b>About</b>, <b>Certificate trust settings</b>: switch "
        "it on.",
    ),
    "android": (
        "Android (Chrome)",
        "Download <a href='{p}ca.crt'>the certificate</a>.",
        "<b>Settings</b>, <b>Security</b>, <b>Encryption and credentials</b>, <b>Install a "
        "certificate</b>, <b>CA certificate</b>; the names differ a little from phone to phone.",
        "Choose the downloaded file. Android warns that somebody could read along: the certificate "
        "is only good for this machine's names and private addresses.",
    ),
    "linux": (
        "Linux (Chrome, Chromium)",
        "Download <a href='{p}ca.pem'>the certificate</a>.",
        "In the browser: <b>Settings</b>, <b>Privacy and security</b>, <b>Security</b>, <b>Manage "
        "certificates</b>, <b>Authorities</b> or <b>Custom</b>, <b>Import</b>; trust it for "
        "websites.",
        "For programs such as curl give the file: <code>curl --cacert ca.pem</code>. For the whole "
        "machine (Debian): copy it as <code>/usr/local/share/ca-certificates/farhand.crt</code> "
        "and run <code>sudo update-ca-certificates</code>.",
    ),
    "firefox": (
        "Firefox (all systems)",
        "Firefox has a list of its own. Download <a href='{p}ca.pem'>the certificate</a>.",
        "<b>Settings</b>, <b>Privacy &amp; security</b>, <b>Certificates</b>, <b>View "
        "certificates</b>, <b>Authorities</b>, <b>Import</b>.",
        "Tick <b>Trust this CA to identify websites</b>.",
    ),
}


def system_of(agent: str) -> str | None:
    """Which of the systems a ``User-Agent`` header names."""
    for word, system in (
        ("firefox/", "firefox"), ("iphone", "ios"), ("ipad", "ios"), ("android", "android"),
        ("windows", "windows"), ("macintosh", "mac"), ("linux", "linux"),
    ):  # fmt: skip
        if word in agent.lower():
            return system
    return None


@router.get("/trust")
async def trust_page(request: Request) -> HTMLResponse:
    """What to do, with the visitor's own system open."""
    authority: LocalAuthority | None = request.app.state.authority
    if authority is None:
        body = (
            "<main><h1>Nothing to trust</h1><p>This server made no certificate of its own: it "
            "either listens on this machine alone, or has a certificate that it was given. If the "
            "browser warns you of it, ask who set the server up.</p></main>"
        )
        return page("Farhand: trust", body)
    own = system_of(request.headers.get("user-agent", ""))
    # Ours is first; a page at /trust has its files at trust/.
    ordered = sorted(_SYSTEMS, key=lambda system: system != own)
    parts = []
    for system in ordered:
        title, *steps = _SYSTEMS[system]
        listed = "".join(f"<li>{step.replace('{p}', 'trust/')}</li>" for step in steps)
        is_open = " open" if system == own else ""
        parts.append(f"<details{is_open}><summary>{title}</summary><ol>{listed}</ol></details>")
    body = (
        "<main><h1>Make this browser trust the server</h1>"
        "<p>What you show the camera goes to this server encrypted. So that the browser knows that "
        "it speaks to the right one, it has to know the server's own certificate authority, once. "
        "It then stays quiet, also when the server renews its certificate.</p>"
        "<h2>1. Compare</h2><p>Whoever runs the server sees these numbers where it was started, or "
        "with <code>farhand trust</code>. Go on only if they are the same (SHA-256):</p>"
        f'<p class="print"><code>{authority.public.fingerprint}</code></p>'
        f"<h2>2. Trust</h2>{''.join(parts)}"
        "<h2>3. Go on</h2><p>Close this tab and open the link that the server printed. The "
        "authority can speak for this machine's names and for private addresses alone, never for "
        "the websites you use. When you need it no more, remove it at the same place.</p></main>"
    )
    return page("Farhand: trust", body)


def _authority(request: Request) -> LocalAuthority:
    authority: LocalAuthority | None = request.app.state.authority
    if authority is None:
        raise NotFound("this server made no certificate of its own")
    return authority


@router.get("/trust/ca.pem")
async def as_pem(request: Request) -> Response:
    """The authority's certificate as text."""
    return _download(_authority(request).public.pem, "farhand-ca.pem", "application/x-pem-file")


@router.get("/trust/ca.crt")
async def as_der(request: Request) -> Response:
    """The authority's certificate as Windows, macOS and phones install it."""
    return _download(_authority(request).public.der, "farhand-ca.crt", "application/x-x509-ca-cert")


def _download(data: bytes, name: str, kind: str) -> Response:
    return Response(
        data, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )
