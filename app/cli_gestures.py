"""The commands about gestures, and the settings and store that they share."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError

from app.config import Settings
from app.errors import CannotStart, Invalid
from app.gestures import GestureStore
from app.link.actions import ACTION

gestures_app = typer.Typer(help="The gesture database.", no_args_is_help=True)

DataDir = Annotated[Path | None, typer.Option(help="Folder that holds the database.")]


def settings_for(**given: Any) -> Settings:
    """Settings from the environment, overridden by every option that was given (is not None)."""
    return Settings(**{name: value for name, value in given.items() if value is not None})


def open_store(settings: Settings) -> GestureStore:
    """Open the database of ``settings``; a new one is filled with the starter set.

    Raises:
        DatabaseBroken: it is there, but cannot be read.
        CannotStart: the folder cannot be made or written.
    """
    from app.gateway.gallery import open_store as open_configured

    return open_configured(settings)


@gestures_app.command("list")
def list_gestures(
    data_dir: DataDir = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the enrolled gestures and their actions."""
    store = open_store(settings_for(data_dir=data_dir))
    try:
        gestures = store.list()
    finally:
        store.close()
    if as_json:
        rows = [
            {
                "id": gesture.id,
                "name": gesture.name,
                "action": ACTION.dump_python(gesture.action, mode="json", exclude_none=True),
                "samples": len(gesture.samples),
            }
            for gesture in gestures
        ]
        print(json.dumps(rows, indent=2, ensure_ascii=False))
        return
    for gesture in gestures:
        action = ACTION.dump_json(gesture.action, exclude_none=True).decode()
        print(f"{gesture.name:20} {len(gesture.samples):3} samples  {action}")


@gestures_app.command("export")
def export(
    folder: Annotated[Path, typer.Argument(help="New folder, or a .zip file.")],
    data_dir: DataDir = None,
) -> None:
    """Write all gestures in the open exchange format."""
    from app.gestures.exchange import export_set

    store = open_store(settings_for(data_dir=data_dir))
    try:
        export_set(store, folder)
        print(f"{len(store.list())} gestures written to {folder}")
    finally:
        store.close()


@gestures_app.command("import")
def import_(
    folder: Annotated[Path, typer.Argument(help="Folder or .zip in the exchange format.")],
    data_dir: DataDir = None,
    replace: Annotated[bool, typer.Option(help="Overwrite gestures of the same name.")] = False,
) -> None:
    """Read gestures in the exchange format: all of them, or none."""
    from app.gestures.exchange import import_set

    store = open_store(settings_for(data_dir=data_dir))
    try:
        import_set(store, folder, replace=replace)
        print(f"imported; the database now holds {len(store.list())} gestures")
    finally:
        store.close()


def draw_starter_set(
    folder: Annotated[Path, typer.Argument(help="New folder for the set.")],
) -> None:
    """Draw the starter set with the hand renderer, through the pipeline, as it is shipped."""
    from app.gestures.starter import draw_starter_set as draw_set
    from app.pipeline import extract_template

    settings = settings_for().pipeline
    draw_set(folder, lambda image: extract_template(image, settings).template)
    print(f"starter set drawn in {folder}")


def draw_operator(
    folder: Annotated[
        Path, typer.Argument(help="Folder for operator.webm and operator.json.")
    ] = Path("app/static/media"),
) -> None:
    """Draw the synthetic operator that the page plays when there is no camera, as it is shipped."""
    from app.gestures.synthetic import operator_clip

    folder.mkdir(parents=True, exist_ok=True)
    captions = operator_clip(folder / "operator.webm")
    rows = [caption._asdict() for caption in captions]
    (folder / "operator.json").write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    print(f"synthetic operator drawn in {folder}")


def enrol(
    name: Annotated[str, typer.Argument(help="Name of the new gesture.")],
    images: Annotated[list[Path], typer.Argument(help="One or more photos of the hand.")],
    action: Annotated[str, typer.Option(help='Action as JSON, such as \'{"type": "home"}\'.')],
    data_dir: DataDir = None,
) -> None:
    """Enrol a gesture from one or more photos."""
    from app.pipeline import extract_template, pack_template

    try:
        parsed = ACTION.validate_json(action)
    except ValidationError as error:
        first = error.errors()[0]
        raise Invalid(f"the action is not valid: {first['msg']}", action=action) from error
    settings = settings_for(data_dir=data_dir)
    templates = []
    for image in images:
        try:
            data = image.read_bytes()
        except OSError as error:
            raise CannotStart(f"{image} cannot be read: {error.strerror}") from error
        templates.append(pack_template(extract_template(data, settings.pipeline).template))
    store = open_store(settings)
    try:
        gesture = store.create(name, parsed, templates)
    finally:
        store.close()
    print(f"enrolled {gesture.name!r} with {len(templates)} samples")
