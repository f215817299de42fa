"""The commands about networks: which are here, whose they are, and bringing those that are not."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from app.cli_gestures import settings_for
from app.errors import CannotStart

models_app = typer.Typer(
    help="Networks for recognition: which are here, and bringing those that are not.",
    no_args_is_help=True,
)


@models_app.command("list")
def list_models(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the networks, whose they are, and where each is."""
    from app.pipeline.hand_landmarks.files import all_found

    found = all_found(settings_for().pipeline.landmarks.folder)
    rows = [
        {
            "name": one.model.name,
            "whose": "MediaPipe (Apache-2.0)",
            "path": one.path and str(one.path),
            "why_not": one.why_not or None,
        }
        for one in found.values()
    ]
    if as_json:
        print(json.dumps(rows, indent=2))
        return
    print("hand_mask.onnx, hand_shape.onnx  Farhand's own, part of it (training/MODEL_CARD.md)")
    for one in found.values():
        print(
            f"{one.model.name:26} MediaPipe's, Apache-2.0: {one.path or one.why_not or 'missing'}"
        )
    if any(one.path is None for one in found.values()):
        print(
            "farhand models add brings those that are missing; without them hands are found by mask"
        )


@models_app.command("add")
def add_models(
    wheel: Annotated[
        Path | None,
        typer.Option(help="A wheel of mediapipe that is here already; then nothing is downloaded."),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask first.")] = False,
) -> None:
    """Take MediaPipe's networks for hand landmarks from its official wheel.

    pip downloads the wheel (35 MB; pinned by its hash; without its dependencies), four files of it
    (12 MB) are copied into your own folder, and the rest is thrown away. They are Google's, under
    the Apache License 2.0. No code of MediaPipe is installed or run.
    """
    from app.pipeline.hand_landmarks.files import own_folder, take_from

    folder = own_folder()
    if wheel is None and not yes:
        typer.confirm(
            f"Download the wheel of mediapipe (35 MB) with pip, keep four networks in {folder}?",
            abort=True,
        )
    if wheel is not None:
        written = take_from(wheel, folder)
    else:
        with tempfile.TemporaryDirectory() as scratch:
            download(Path(scratch))
            written = take_from(Path(scratch), folder)
    for path in written:
        print(path)


def download(target: Path) -> None:
    """Install the pinned wheel alone into a folder, by pip or uv, whichever is here.

    Raises:
        CannotStart: neither is, or it failed.
    """
    from app.pipeline.hand_landmarks.files import lock_file

    given = ["install", "--quiet", "--no-deps", "--only-binary", ":all:", "--require-hashes"]
    given += ["--target", str(target), "-r", str(lock_file())]
    search = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    if importlib.util.find_spec("pip") is not None:
        command = [sys.executable, "-m", "pip", *given]
    elif (uv := shutil.which("uv", path=search)) is not None:
        command = [uv, "pip", *given, "--python", sys.executable]
    else:
        raise CannotStart(
            f"neither pip nor uv is here: download the wheel that {lock_file()} names, "
            "and give it with --wheel"
        )
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no reason given"]
        raise CannotStart(f"the wheel cannot be downloaded: {last[0]}")
