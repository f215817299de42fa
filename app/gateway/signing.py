"""Signing in and out: the link, the form, and who one is."""

from typing import Any
from urllib.parse import parse_qs

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response

from app.errors import NotAllowed, NotSignedIn
from app.gateway.auth import Gatekeeper, identity_of
from app.gateway.errors import error_response
from app.gateway.fetch_metadata import is_foreign, is_part_of_a_page
from app.gateway.guard import signed_out_page, too_many_response
from app.gateway.pages import confirm_page, sign_in_page
from app.gateway.throttle import TooManyGuesses

router = APIRouter()

MAX_SIGN_IN = 4096
WRONG_TOKEN = "That token is not one of this server's."
FOREIGN = "a page that is not this server's may sign nobody in"


def sign_in_by_link(request: Request, token: str) -> Response:
    """``GET /?token=``: at once for who opened the link, after a question for who followed it.

    What a page loads, such as a picture, is no link that somebody opens: its token is not looked
    at, so that no page can use up the tries of who looks at it.
    """
    if is_part_of_a_page(request.headers):
        return error_response(NotAllowed(FOREIGN, code="foreign_origin"))
    if is_foreign(request.headers):
        return confirm_page(token[:MAX_SIGN_IN], prefix=request.app.state.settings.root_path)
    return _signed_in(request, token)


@router.get("/signin", include_in_schema=False)
async def sign_in_form(request: Request) -> Response:
    """A field for the token."""
    return sign_in_page(prefix=request.app.state.settings.root_path, status=200)


@router.post("/signin", include_in_schema=False)
async def sign_in(request: Request) -> Response:
    """The sign-in page's form: ``token=...``, URL-encoded."""
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    if is_foreign(request.headers):
        return error_response(NotAllowed(FOREIGN, code="foreign_origin"))
    if "origin" in request.headers:
        try:
            gatekeeper.check_origin(request.headers)
        except NotAllowed as error:
            return error_response(error)
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MAX_SIGN_IN:
            return _wrong(request)
    fields = parse_qs(body.decode("utf-8", "replace"))
    return _signed_in(request, fields.get("token", [""])[0].strip())


def _signed_in(request: Request, token: str) -> Response:
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    try:
        given = gatekeeper.sign_in(token, request.scope["farhand.client"])
    except TooManyGuesses as error:
        if "text/html" in request.headers.get("accept", ""):
            return _wrong(request, f"{error.message}.", error.status)
        return too_many_response(error)
    if given is None:
        return _wrong(request)
    answer = RedirectResponse(f"{request.app.state.settings.root_path}/{given.fragment}", 303)
    answer.headers["Set-Cookie"] = given.cookie
    return answer


def _wrong(request: Request, problem: str = WRONG_TOKEN, status: int = 401) -> Response:
    if "text/html" in request.headers.get("accept", ""):
        prefix = request.app.state.settings.root_path
        return signed_out_page(request.headers, prefix, "/", problem, status)
    return error_response(NotSignedIn("this token is not one of this server's"))


@router.get("/api/session", tags=["server"], summary="Who is asking?")
async def session(request: Request) -> dict[str, Any]:
    """The role and the token of who asks; not the token itself, which the server does not keep."""
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    identity = identity_of(request.scope)
    if identity is None or (token := gatekeeper.token_of(identity)) is None:
        raise NotSignedIn("this token is not one of this server's any more")
    return {
        "role": token.role,
        "token": token.id,
        "name": token.name,
        "expires": None if token.expires is None else token.expires.isoformat(),
    }


@router.post("/api/sign-out", status_code=204, tags=["server"], summary="Sign this browser out")
async def sign_out(request: Request) -> Response:
    """Take the cookie back, and end what this browser has open; the token stays good."""
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    identity = identity_of(request.scope)
    if identity is not None:
        gatekeeper.connections.end_browser(identity)
    return Response(status_code=204, headers={"Set-Cookie": gatekeeper.set_cookie_header(None)})
