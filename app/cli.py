"""The command line: one short function a command; the work is done elsewhere.

Every error of this project ends as one line on standard error and exit code 1; a wrong option as
the option's own message and exit code 2. Parts are imported by the command that needs them, so
that ``farhand gestures list`` does not wait for PyBullet.
"""

import json
import logging
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError

from app.cli_gestures import draw_operator, draw_starter_set, enrol, gestures_app, settings_for
from app.cli_models import models_app
from app.cli_tokens import tokens_app, trust
from app.errors import FarhandError
from app.log_text import LineFormatter

log = logging.getLogger(__name__)

app = typer.Typer(
    name="farhand",
    help="Drive a robot arm that stands somewhere else by showing hand gestures to a webcam.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(gestures_app, name="gestures")
app.add_typer(tokens_app, name="token")
app.add_typer(models_app, name="models")
app.command("enroll")(enrol)
app.command("trust")(trust)
gestures_app.command("draw")(draw_starter_set)
gestures_app.command("draw-operator")(draw_operator)

DataDir = Annotated[
    Path | None, typer.Option(help="Folder for the database, the token and the link.")
]


@app.command()
def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 0 picks a free one.")] = None,
    data_dir: DataDir = None,
    token: Annotated[
        str | None,
        typer.Option(
            help="Secret that opens the page and the API. Others see it in the list of processes."
        ),
    ] = None,
    token_file: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File that holds such a secret.")
    ] = None,
    tls_cert: Annotated[Path | None, typer.Option(help="Certificate chain (PEM).")] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Private key (PEM).")] = None,
    behind_proxy: Annotated[
        bool | None, typer.Option(help="A proxy in front of this server does HTTPS.")
    ] = None,
    proxy_address: Annotated[
        list[str] | None,
        typer.Option(help="Address or network of that proxy; may be repeated. Default: loopback."),
    ] = None,
    root_path: Annotated[
        str | None, typer.Option(help="Path below which that proxy shows this server.")
    ] = None,
    allowed_host: Annotated[
        list[str] | None,
        typer.Option(help="One more name by which browsers reach this server; may be repeated."),
    ] = None,
    robot_endpoint: Annotated[
        str | None,
        typer.Option(help="Zenoh endpoint of a robot node that runs elsewhere; starts none here."),
    ] = None,
    robot_profile: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Profile of the robot: a TOML file, or the name of a built-in one."
        ),
    ] = None,
) -> None:
    """Start the server: the page, the API, the 3D view and a robot node."""
    from app.gateway.given_token import IN_ARGUMENTS
    from app.gateway.serve import serve as run_server

    given: dict[str, Any] = {
        "host": host,
        "port": port,
        "data_dir": data_dir,
        "token": token,
        "token_file": token_file,
        "tls_cert": tls_cert,
        "tls_key": tls_key,
        "behind_proxy": behind_proxy,
        "proxy_addresses": proxy_address or None,
        "root_path": root_path,
    }
    if allowed_host:
        given["gateway"] = {"allowed_hosts": allowed_host}
    robot: dict[str, Any] = {}
    if robot_endpoint is not None:
        robot |= {"spawn": False, "endpoint": robot_endpoint}
    if robot_profile is not None:
        robot["profile"] = robot_profile
    if robot:
        given["robot"] = robot
    # Said by the server, whose log waits for nobody.
    run_server(settings_for(**given), remarks=() if token is None else (IN_ARGUMENTS,))


@app.command()
def robot(
    endpoint: Annotated[str, typer.Option(help="Zenoh endpoint to listen on.")],
    id: Annotated[str, typer.Option(help="Name of the robot on the link.")] = "puma",
    profile: Annotated[
        str,
        typer.Option(
            metavar="FILE", help="Profile of the robot: a TOML file, or the name of a built-in one."
        ),
    ] = "puma560",
    latch: Annotated[
        Path | None, typer.Option(help="File that keeps a latched stop over a restart.")
    ] = None,
) -> None:
    """Start a robot node by itself, for a gateway that runs elsewhere."""
    from app import logs
    from app.config import NodeSettings
    from app.private import keep_private
    from app.robot.node import run_node

    keep_private()
    settings = NodeSettings(id=id, profile=profile, endpoint=endpoint, latch=latch)
    with logs.written_apart():
        run_node(settings)


@app.command()
def evaluate(
    directory: Annotated[Path, typer.Argument(help="Folder that holds LABEL/*.jpg.")],
    shots: Annotated[int, typer.Option(min=1, help="Images a label to enrol.")] = 1,
    trials: Annotated[int, typer.Option(min=1, help="How often to draw them anew.")] = 10,
    seed: Annotated[int, typer.Option(help="Seed of the drawing.")] = 0,
    reject: Annotated[bool, typer.Option(help="Allow the answer 'unknown'.")] = False,
    unknown: Annotated[
        Path | None, typer.Option(help="Folder of labels that are never enrolled.")
    ] = None,
    holdout_labels: Annotated[
        int, typer.Option(min=0, help="Labels left out in each trial, to play the unknown.")
    ] = 0,
    group: Annotated[
        str | None,
        typer.Option(
            metavar="REGEX",
            help="Finds the room or person in a file name, such as '^[^-]+'; "
            "none of them is both enrolled from and asked about.",
        ),
    ] = None,
    json_to: Annotated[
        Path | None, typer.Option("--json", help="Write JSON to a file, or to - for stdout.")
    ] = None,
) -> None:
    """Enrol some images of a folder at random and recognise the rest."""
    from app.pipeline.evaluate import evaluate as run

    result = run(
        directory,
        shots=shots,
        trials=trials,
        seed=seed,
        reject=reject,
        unknown=unknown,
        settings=settings_for().pipeline,
        group=group,
        holdout_labels=holdout_labels,
    )
    text = json.dumps(result, indent=2)
    if json_to is not None and str(json_to) != "-":
        json_to.write_text(text + "\n")
        accuracy, text = result["accuracy"], ""
        if result["curve"]:
            text = (
                f"unknown accepted {result['unknown_accepted']:.1%}, known missed where 5% "
                f"of them are accepted {result['missed_at_5_percent_accepted']:.1%}; "
            )
        print(
            f"accuracy {accuracy['mean']:.3f} ± {accuracy['std']:.3f}; {text}written to {json_to}"
        )
    else:
        print(text)


@app.command()
def replay(
    source: Annotated[Path, typer.Argument(help="A video file, or a folder of images.")],
    data_dir: DataDir = None,
) -> None:
    """Send a video or an image folder through the pipeline; print events as JSON lines."""
    from app.cli_gestures import open_store
    from app.gateway.gallery import build_matcher
    from app.pipeline import Pipeline
    from app.pipeline.replay import replay as run

    settings = settings_for(data_dir=data_dir)
    store = open_store(settings)
    try:
        matcher = build_matcher(store, settings.pipeline)
    finally:
        store.close()
    for record in run(source, Pipeline(settings.pipeline, matcher)):
        print(json.dumps(record), flush=True)


@app.command()
def doctor(data_dir: DataDir = None, port: int | None = None) -> None:
    """Check what Farhand needs on this machine, and say how to mend what is wrong."""
    from app.doctor import run_checks
    from app.private import keep_private

    keep_private()
    if not run_checks(settings_for(data_dir=data_dir, port=port)):
        raise typer.Exit(1)


def main() -> None:
    """Run the command line; turn this project's errors into one line and exit code 1."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(LineFormatter("%(asctime)s %(levelname)s %(message)s"))
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    logging.getLogger("alembic").setLevel(logging.WARNING)
    try:
        app()
    except FarhandError as error:
        print(f"farhand: {error.message}", file=sys.stderr)
        sys.exit(1)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        print(f"farhand: {where}: {first['msg']}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        # Whoever read our output has gone: `farhand replay … | head`.
        sys.stderr.close()
        sys.exit(1)
