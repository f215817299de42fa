"""The application: every route, behind one door."""

import asyncio
import mimetypes
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from starlette.middleware.gzip import GZipMiddleware
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles

from app.config import Settings
from app.errors import CannotStart, NotSignedIn
from app.gateway import (
    cameras,
    rest_dry_run,
    rest_exchange,
    rest_galleries,
    rest_gestures,
    rest_jobs,
    rest_matrix,
    rest_programs,
    rest_robots,
    rest_samples,
    rest_server,
    rest_settings,
    rest_timeline,
    signing,
    trust,
    viser_proxy,
)
from app.gateway.auth import Gatekeeper, identity_of
from app.gateway.errors import EVERYWHERE, error_response, install_error_handlers
from app.gateway.guard import Guard, signed_out_page
from app.gateway.hub import Hub, package_version
from app.gateway.messages import CLIENT_MESSAGES
from app.gateway.operator_ws import operator_socket
from app.gateway.roles import check_messages, check_routes
from app.gateway.signing import sign_in_by_link
from app.gateway.tls import LocalAuthority
from app.gateway.tokens import TokenStore

STATIC = Path(__file__).parents[1] / "static"

pages = APIRouter(include_in_schema=False)


@pages.get("/")
async def index(request: Request, token: str | None = None) -> Response:
    """The page; with ``?token=`` sign in first; without any sign-in ask for the token."""
    if token is not None:
        return sign_in_by_link(request, token)
    if identity_of(request.scope) is None:
        if "text/html" in request.headers.get("accept", ""):
            return signed_out_page(request.headers, request.app.state.settings.root_path, "/")
        return error_response(NotSignedIn("open the link that the server printed"))
    return FileResponse(STATIC / "index.html", headers={"Cache-Control": "no-cache"})


def create_app(
    settings: Settings,
    *,
    token: str | None = None,
    tokens: TokenStore | None = None,
    authority: LocalAuthority | None = None,
    is_ending: Callable[[], bool] = lambda: False,
) -> FastAPI:
    """The application; its lifespan opens and closes everything.

    Args:
        settings: Of the whole server.
        token: An operator's token in place of the settings' own.
        tokens: The known tokens, where they were opened already.
        authority: What made the certificate, if it was made here.
        is_ending: Asked while the start waits for the robot: whether to give up.

    Raises:
        CannotStart: the page is not installed, the tokens cannot be read, or a route or message is
            missing in the table of who may do what.
    """
    if not (STATIC / "index.html").is_file():
        raise CannotStart(
            f"the page is missing at {STATIC}; install Farhand anew", path=str(STATIC)
        )
    if tokens is None:
        tokens = TokenStore.from_settings(settings, token)
    certified = None if authority is None else (lambda: authority.names.hosts())
    gatekeeper = Gatekeeper.from_settings(settings, tokens, certified)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with Hub.open(settings, is_ending) as hub:
            app.state.hub = hub
            hub.diary.watch_sign_ins(lambda: gatekeeper.throttle.wrong)
            watch = asyncio.create_task(gatekeeper.connections.watch())
            try:
                yield
            finally:
                watch.cancel()
                await asyncio.gather(watch, return_exceptions=True)

    app = FastAPI(
        title="Farhand",
        description="Drive a robot arm by hand gestures. WebSockets: see docs/protocol.md.",
        version=package_version(),
        responses=EVERYWHERE,
        lifespan=lifespan,
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        # It would answer with an address that it makes of the path and of the Host header.
        redirect_slashes=False,
    )
    app.state.gatekeeper = gatekeeper
    app.state.authority = authority
    app.state.settings = settings
    install_error_handlers(app)
    app.add_middleware(
        Guard,
        gatekeeper=gatekeeper,
        prefix=settings.root_path,
        body_s=settings.gateway.body_s,
    )
    for router in (
        pages,
        signing.router,
        trust.router,
        rest_gestures.router,
        rest_galleries.router,
        rest_settings.router,
        rest_programs.router,
        rest_samples.router,
        rest_exchange.router,
        rest_matrix.router,
        rest_jobs.router,
        rest_robots.router,
        rest_dry_run.router,
        cameras.router,
        cameras.sockets,
        rest_server.router,
        rest_timeline.router,
        viser_proxy.router,
    ):
        app.include_router(router)
    app.add_api_websocket_route("/ws/operator", operator_socket)
    mimetypes.add_type("image/webp", ".webp")  # not known on every system
    # The video is compressed already, and browsers ask for parts of it.
    app.mount("/static/media", StaticFiles(directory=STATIC / "media"), name="media")
    app.mount("/static", GZipMiddleware(StaticFiles(directory=STATIC), 1024), name="static")
    check_routes(app.routes)
    check_messages(CLIENT_MESSAGES)
    return app
