"""The commands about who may come in: tokens, and the certificate authority."""

import datetime
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli_gestures import settings_for
from app.errors import CannotStart, Invalid

if TYPE_CHECKING:
    from app.config import Settings
    from app.gateway.roles import Role
    from app.gateway.tokens import Token, TokenStore

tokens_app = typer.Typer(
    help="Who may come in: make, list and revoke tokens.", no_args_is_help=True
)

DataDir = Annotated[Path | None, typer.Option(help="Folder that holds the tokens.")]

_UNITS = {"m": 60, "h": 3600, "d": 86400}


def _store(settings: "Settings") -> "TokenStore":
    """The file alone: a token from the environment is not of these commands' making."""
    from app.gateway.tokens import TokenStore
    from app.private import keep_private, private_folder

    keep_private()
    if settings.data_dir.exists():
        private_folder(settings.data_dir)
    return TokenStore.from_settings(settings.model_copy(update={"token": None}))


def _lifetime(text: str) -> datetime.timedelta | None:
    """``30d``, ``12h``, ``45m``, or ``never``.

    Raises:
        Invalid: something else.
    """
    if text == "never":
        return None
    number, unit = text[:-1], _UNITS.get(text[-1:])
    if unit is None or not number.isdecimal() or not 1 <= int(number) * unit <= 3650 * 86400:
        raise Invalid(f"--expires is 30d, 12h, 45m or never, ten years at most, not {text[:20]!r}")
    return datetime.timedelta(seconds=int(number) * unit)


@tokens_app.command("make")
def make_token(
    role: Annotated[str, typer.Option(help="operator (drives) or observer (watches).")],
    name: Annotated[str, typer.Option(help="Whom or what it is for.")] = "",
    expires: Annotated[str, typer.Option(help="30d, 12h, 45m, or never.")] = "30d",
    data_dir: DataDir = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Make a token and print it with its link. It is shown this once and kept nowhere."""
    from app.gateway.greeting import last_address, link, print_code

    if role not in ("operator", "observer"):
        raise Invalid(f"--role is operator or observer, not {role[:20]!r}")
    if len(name) > 60 or not name.isprintable():
        raise Invalid("--name has 60 printable characters at most")
    chosen: Role = "operator" if role == "operator" else "observer"
    settings = settings_for(data_dir=data_dir)
    secret, token = _store(settings).make(chosen, name, _lifetime(expires))
    address = last_address(settings)
    url = None if address is None else link(address, secret)
    if as_json:
        print(json.dumps({**_row(token), "token": secret, "link": url}, indent=2))
        return
    print(f"token: {secret}")
    if url is None:
        print("link:  the server's address, with ?token= and the token at its end")
        return
    print(f"link:  {url}")
    if sys.stdout.isatty():
        print_code(url, sys.stdout)


@tokens_app.command("list")
def list_tokens(
    data_dir: DataDir = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the tokens; the secrets themselves are not kept."""
    tokens = _store(settings_for(data_dir=data_dir)).list()
    if as_json:
        print(json.dumps([_row(token) for token in tokens], indent=2, ensure_ascii=False))
        return
    for token in tokens:
        print(f"{token.id:9} {token.role:9} {_ends(token):28} {token.name}")


@tokens_app.command("revoke")
def revoke_tokens(
    ids: Annotated[list[str], typer.Argument(help="Ids as `farhand token list` shows them.")],
    data_dir: DataDir = None,
) -> None:
    """Take tokens back. Who came in with one is out within a second."""
    store = _store(settings_for(data_dir=data_dir))
    for id in ids:
        token = store.revoke(id)
        print(f"revoked {token.id} ({token.role}) {token.name}".rstrip())


def trust(data_dir: DataDir = None) -> None:
    """Print the fingerprint and the certificate of this server's own authority."""
    from app.gateway.tls import FOLDER, read_authority

    folder = settings_for(data_dir=data_dir).data_dir / FOLDER
    found = read_authority(folder)
    if found is None:
        raise CannotStart(
            f"there is no certificate authority in {folder}: it is made when the server first "
            "listens for other machines",
            path=str(folder),
        )
    print(f"SHA-256 {found.fingerprint}")
    print(found.pem.decode(), end="")


def _ends(token: "Token") -> str:
    if token.expires is None:
        return "does not expire"
    day = token.expires.astimezone().strftime("%Y-%m-%d %H:%M")
    over = token.has_expired(datetime.datetime.now(datetime.UTC))
    return f"{'expired' if over else 'expires'} {day}"


def _row(token: "Token") -> dict[str, object]:
    return token.model_dump(mode="json", include={"id", "role", "name", "created", "expires"})
