"""The application: every route, behind one door."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from urllib.parse import parse_qs

from fastapi import APIRouter, FastAPI, Request
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles

from app.config import Settings
from app.errors import CannotStart, NotSignedIn
from app.gateway import (
    cameras,
    rest_dry_run,
    rest_gestures,
    rest_programs,
    rest_robots,
    rest_server,
    viser_proxy,
)
from app.gateway.auth import Gatekeeper, load_token
from app.gateway.errors import error_response, install_error_handlers
from app.gateway.guard import Guard, signed_out_page
from app.gateway.hub import Hub, package_version
from app.gateway.operator_ws import operator_socket

STATIC = Path(__file__).parents[1] / "static"
MAX_SIGN_IN = 4096
WRONG_TOKEN = "That token is not the one of this server."

pages = APIRouter(include_in_schema=False)


@pages.get("/")
async def index(request: Request, token: str | None = None) -> Response:
    """The page; with ``?token=`` sign in first; without any sign-in ask for the token."""
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    if token is not None:
        return _signed_in(request, token)
    if gatekeeper.credential(request.headers) is None:
        if "text/html" in request.headers.get("accept", ""):
            return signed_out_page(request.headers, "/")
        return error_response(NotSignedIn("open the link that the server printed"))
    return FileResponse(STATIC / "index.html", headers={"Cache-Control": "no-cache"})


@pages.post("/signin")
async def sign_in(request: Request) -> Response:
    """The sign-in page's form: ``token=...``, URL-encoded."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MAX_SIGN_IN:
            return signed_out_page(request.headers, "/", WRONG_TOKEN)
    fields = parse_qs(body.decode("utf-8", "replace"))
    return _signed_in(request, fields.get("token", [""])[0].strip())


def _signed_in(request: Request, token: str) -> Response:
    gatekeeper: Gatekeeper = request.app.state.gatekeeper
    if gatekeeper.token_fits(token):
        answer = RedirectResponse("/", 303)
        answer.headers["Set-Cookie"] = gatekeeper.set_cookie_header()
        return answer
    if "text/html" in request.headers.get("accept", ""):
        return signed_out_page(request.headers, "/", WRONG_TOKEN)
    return error_response(NotSignedIn("this token is not the one of this server"))


def create_app(
    settings: Settings, *, token: str | None = None, is_ending: Callable[[], bool] = lambda: False
) -> FastAPI:
    """The application; its lifespan opens and closes everything.

    Args:
        settings: Of the whole server.
        token: The secret, where it was loaded already.
        is_ending: Asked while the start waits for the robot: whether to give up.

    Raises:
        CannotStart: the page is not installed, or the token cannot be kept.
    """
    if not (STATIC / "index.html").is_file():
        raise CannotStart(
            f"the page is missing at {STATIC}; install Farhand anew", path=str(STATIC)
        )
    gatekeeper = Gatekeeper.from_settings(settings, token or load_token(settings))

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with Hub.open(settings, is_ending) as hub:
            app.state.hub = hub
            yield

    app = FastAPI(
        title="Farhand",
        description="Drive a robot arm by hand gestures. WebSockets: see docs/protocol.md.",
        version=package_version(),
        lifespan=lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
    )
    app.state.gatekeeper = gatekeeper
    app.state.settings = settings
    install_error_handlers(app)
    app.add_middleware(Guard, gatekeeper=gatekeeper)
    for router in (
        pages,
        rest_gestures.router,
        rest_programs.router,
        rest_robots.router,
        rest_dry_run.router,
        cameras.router,
        cameras.sockets,
        rest_server.router,
        viser_proxy.router,
    ):
        app.include_router(router)
    app.add_api_websocket_route("/ws/operator", operator_socket)
    # The video is compressed already, and browsers ask for parts of it.
    app.mount("/static/media", StaticFiles(directory=STATIC / "media"), name="media")
    app.mount("/static", GZipMiddleware(StaticFiles(directory=STATIC), 1024), name="static")
    return app
