"""The few small pages that the gateway makes itself: signing in, and the list of REST routes."""

import base64
import hashlib
from html import escape
from typing import Any
from urllib.parse import quote

from starlette.responses import HTMLResponse

_STYLE = """
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }
body { max-width: 46rem; margin: 3rem auto; padding: 0 1rem; }
main.narrow { max-width: 24rem; margin: auto; }
label, input, button { display: block; width: 100%; box-sizing: border-box; font: inherit; }
input, button { padding: .6rem; margin: .3rem 0 1rem; }
button { cursor: pointer; }
.problem { border-left: .3rem solid #c22; padding-left: .7rem; }
code { font-family: ui-monospace, monospace; overflow-wrap: anywhere; }
summary { cursor: pointer; font-weight: 600; padding: .4rem 0; }
details { border-top: 1px solid #8886; }
.print { font-size: 1.05rem; }
td, th { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0; }
"""
_DIGEST = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
_POLICY = (
    f"default-src 'none'; style-src 'sha256-{_DIGEST}'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'self'"
)


def page(
    title: str, body: str, *, status: int = 200, head: str = "", form: bool = False
) -> HTMLResponse:
    """One page, without scripts; ``body`` and ``head`` are HTML; ``form``: it has a form."""
    html = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"{head}<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body>{body}</body></html>\n"
    )
    headers = {"Content-Security-Policy": _POLICY}
    if form:
        # Not "no-referrer", under which browsers send a form with "Origin: null".
        headers["Referrer-Policy"] = "strict-origin"
    return HTMLResponse(html, status_code=status, headers=headers)


def own_path(path: str) -> str:
    r"""A path as a browser has to be sent to it, so that it stays on this server.

    ``//host`` names another host, and so does ``/\\host``, since browsers read a backslash as a
    slash; both begin with one slash here, and everything but the characters of paths is escaped.
    """
    return "/" + quote(path.lstrip("/\\"), safe="/~!$&'()*+,;=:@")


def sign_in_page(
    problem: str | None = None, *, prefix: str = "", status: int = 401
) -> HTMLResponse:
    """A field for the token. ``prefix`` is the path below which a proxy shows this server."""
    told = f'<p class="problem" role="alert">{escape(problem)}</p>' if problem else ""
    body = (
        '<main class="narrow"><h1>Farhand</h1>'
        "<p>Open the link that the server printed when it started, or enter its token here.</p>"
        f'{told}<form method="post" action="{prefix}/signin"><label for="token">Token</label>'
        '<input id="token" name="token" type="password" required autofocus autocomplete="off">'
        "<button>Sign in</button></form><p>Did the browser warn you of this page? "
        f'<a href="{prefix}/trust">How to make it trust this server</a></p></main>'
    )
    return page("Farhand: sign in", body, status=status, form=True)


def confirm_page(token: str, *, prefix: str = "") -> HTMLResponse:
    """Asks who came by a link on another site's page whether to sign in; status 200.

    Else that page could sign somebody in as another person, or use up their tries.
    """
    body = (
        '<main class="narrow"><h1>Farhand</h1>'
        "<p>A link on another page leads here. Sign in with it only if you trust who gave it to "
        "you: this browser is then signed in with its token, and with no other.</p>"
        f'<form method="post" action="{prefix}/signin">'
        f'<input name="token" type="hidden" value="{escape(token, quote=True)}">'
        f'<button autofocus>Sign in</button></form><p><a href="{prefix}/">Go on without it</a></p>'
        "</main>"
    )
    return page("Farhand: sign in", body, form=True)


def again_page(path: str) -> HTMLResponse:
    """Asks for the same page once more, now from this site; status 401."""
    target = escape(own_path(path), quote=True)
    head = f'<meta http-equiv="refresh" content="0;url={target}">'
    body = f'<main class="narrow"><p><a href="{target}">Go on to Farhand</a></p></main>'
    return page("Farhand", body, status=401, head=head)


def routes_page(openapi: dict[str, Any]) -> HTMLResponse:
    """The REST routes as a table, from the OpenAPI description."""
    rows = []
    for path, methods in openapi["paths"].items():
        for method, route in methods.items():
            answers = ", ".join(route.get("responses", {}))
            rows.append(
                f"<tr><td><code>{escape(method.upper())}</code></td><td><code>{escape(path)}</code>"
                f"</td><td>{escape(route.get('summary', ''))}</td><td>{escape(answers)}</td></tr>"
            )
    body = (
        "<main><h1>Farhand: REST</h1><p>The whole description is in "
        '<a href="openapi.json">openapi.json</a>. Errors have one shape: '
        "<code>{&quot;error&quot;: {&quot;code&quot;, &quot;message&quot;, &quot;detail&quot;}}"
        "</code>.</p><table><thead><tr><th>Method</th><th>Path</th><th></th><th>Answers</th></tr>"
        f"</thead><tbody>{''.join(rows)}</tbody></table></main>"
    )
    return page("Farhand: REST", body)
