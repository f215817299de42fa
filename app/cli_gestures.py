"""The commands about gestures, and the settings and store that they share."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app.errors import CannotStart, FarhandError, ImageRefused, Invalid, NotFound

if TYPE_CHECKING:
    from app.config import Settings
    from app.gestures import GestureStore
    from app.gestures.backup import Place
    from app.pipeline.burst import Look
    from app.pipeline.types import U8

gestures_app = typer.Typer(help="The gesture database.", no_args_is_help=True)

DataDir = Annotated[Path | None, typer.Option(help="Folder that holds the database.")]
InGallery = Annotated[
    str, typer.Option("--gallery", metavar="NAME", help="Whose gestures: the gallery's name.")
]
SHARED_NAME = "shared"
"""Finds the shared gallery, whatever it is called now: it is the id."""


def settings_for(**given: Any) -> "Settings":
    """Settings from the environment, overridden by every option that was given (is not None)."""
    from app.config import Settings

    return Settings(**{name: value for name, value in given.items() if value is not None})


def open_store(settings: "Settings") -> "GestureStore":
    """Open the database of ``settings``; a new one is filled with the starter set.

    Raises:
        DatabaseBroken: it is there, but cannot be read.
        CannotStart: the folder cannot be made or written.
    """
    from app.gateway.gallery import open_store as open_configured
    from app.private import keep_private

    keep_private()
    return open_configured(settings)


@gestures_app.command("list")
def list_gestures(
    data_dir: DataDir = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    gallery: InGallery = SHARED_NAME,
) -> None:
    """List the enrolled gestures and their actions."""
    from app.link.actions import ACTION

    store = open_store(settings_for(data_dir=data_dir))
    try:
        gestures = store.list(store.galleries.named(gallery).id)
    finally:
        store.close()
    if as_json:
        rows = [
            {
                "id": gesture.id,
                "name": gesture.name,
                "action": ACTION.dump_python(gesture.action, mode="json", exclude_none=True),
                "samples": len(gesture.samples),
                "active": gesture.active,
                "version": gesture.version,
            }
            for gesture in gestures
        ]
        print(json.dumps(rows, indent=2, ensure_ascii=False))
        return
    for gesture in gestures:
        action = ACTION.dump_json(gesture.action, exclude_none=True).decode()
        state = "" if gesture.active else "  (inactive)"
        print(f"{gesture.name:20} {len(gesture.samples):3} samples  {action}{state}")


@gestures_app.command("export")
def export(
    folder: Annotated[Path, typer.Argument(help="New folder, or a .zip file.")],
    data_dir: DataDir = None,
    gallery: InGallery = SHARED_NAME,
) -> None:
    """Write all gestures of a gallery in the open exchange format."""
    from app.gestures.exchange import export_set

    store = open_store(settings_for(data_dir=data_dir))
    try:
        count = export_set(store, folder, store.galleries.named(gallery).id)
        print(f"{count} gestures written to {folder}")
    finally:
        store.close()


@gestures_app.command("import")
def import_(
    folder: Annotated[Path, typer.Argument(help="Folder or .zip in the exchange format.")],
    data_dir: DataDir = None,
    replace: Annotated[bool, typer.Option(help="Overwrite gestures of the same name.")] = False,
    gallery: InGallery = SHARED_NAME,
) -> None:
    """Read gestures in the exchange format: all of them, or none."""
    from app.gestures.exchange import import_set

    store = open_store(settings_for(data_dir=data_dir))
    try:
        into = store.galleries.named(gallery)
        import_set(store, folder, replace=replace, gallery=into.id)
        print(f"imported; {into.name} now holds {len(store.list(into.id))} gestures")
    finally:
        store.close()


@gestures_app.command("backups")
def list_backups(data_dir: DataDir = None) -> None:
    """List the backups of the database, newest first, each checked."""
    from app.gestures import backup

    for each in backup.found(_place(data_dir)):
        try:
            state = f"{backup.check(each.path)} gestures"
        except FarhandError as error:
            state = f"damaged: {error.message}"
        made = each.made.astimezone().strftime("%Y-%m-%d %H:%M:%S")
        print(f"{each.path.name}  {made}  {state}")


@gestures_app.command("restore")
def restore(
    backup: Annotated[
        str | None, typer.Argument(help="A backup's name or file. Default: the last good one.")
    ] = None,
    accept_new: Annotated[
        bool,
        typer.Option("--accept-new", help="Keep the new database after a broken one was set aside"),
    ] = False,
    data_dir: DataDir = None,
) -> None:
    """Bring a backup of the database back; what it replaces is kept. Ends no server: do that first.

    With --accept-new nothing is brought back: the gestures that are there now are the ones that
    you want, and the robot may be armed again.
    """
    from app.gestures import recovery

    place = _place(data_dir)
    if accept_new:
        if backup is not None:
            raise Invalid("give a backup or --accept-new, not both")
        done = recovery.accept(place)
        print("the gestures that are there now are kept" if done else "nothing was set aside")
        return
    path = None
    if backup is not None:
        path = Path(backup) if "/" in backup else place.backups / backup
    result = recovery.restore(place, path)
    print(f"{result.gestures} gestures are back, from {result.backup}")
    for kept in result.kept:
        print(f"what was there before is kept as {kept}")


def _place(data_dir: Path | None) -> "Place":
    from app.gateway.gallery import place_of
    from app.private import keep_private

    keep_private()
    place = place_of(settings_for(data_dir=data_dir))
    if place is None:
        raise Invalid("backups are made of an SQLite database; this one has its own ways")
    return place


@gestures_app.command("dry-run")
def dry_run(
    name: Annotated[str, typer.Argument(help="Name of the gesture.")],
    start: Annotated[
        str, typer.Option("--from", help="Pose of the robot where the arm begins.")
    ] = "home",
    data_dir: DataDir = None,
) -> None:
    """Say whether what a gesture does would break a limit. Needs no server; nothing moves."""
    from app.config import ArmMotionSettings
    from app.gestures.records import name_key
    from app.robot.rehearsal import STEP_S, Rehearsal
    from app.robot.sim.kinematic_arm import KinematicArm

    store = open_store(settings_for(data_dir=data_dir))
    try:
        found = {name_key(gesture.name): gesture for gesture in store.list()}
    finally:
        store.close()
    gesture = found.get(name_key(name))
    if gesture is None:
        raise NotFound(f"there is no gesture {name!r}; list them with: farhand gestures list")
    arm = KinematicArm(dt=STEP_S)
    try:
        poses = arm.description.poses
        if start not in poses:
            names = ", ".join(sorted(poses))
            raise Invalid(f"this robot has no pose {start!r} to begin at; it has: {names}")
        arm.place(arm.model.pose(start), arm.description.gripper_max, ())
        report = Rehearsal(arm, ArmMotionSettings()).run(gesture.action)
    finally:
        arm.close()
    for problem in report.problems:
        place = "" if problem.step is None else f"step {problem.step}: "
        print(f"{problem.time_s:7.2f} s  {place}{problem.message}")
    verdict = "can be done" if report.ok else "would meet a limit"
    print(f"{gesture.name} {verdict}; it takes {report.duration_s:.1f} s")
    if not report.ok:
        raise typer.Exit(1)


def draw_starter_set(
    folder: Annotated[Path, typer.Argument(help="New folder for the set.")],
) -> None:
    """Draw the starter set with the hand renderer, through the pipeline, as it is shipped."""
    from app.gestures.starter import draw_starter_set as draw_set
    from app.pipeline import extract_template

    settings = settings_for().pipeline

    def extract(image: bytes) -> "tuple[U8, bytes | None]":
        found = extract_template(image, settings)
        return found.template, None if found.hand is None else found.hand.pack()

    draw_set(folder, extract)
    print(f"starter set drawn in {folder}")


def draw_operator(
    folder: Annotated[
        Path, typer.Argument(help="Folder for operator.webm, operator.json and hands/.")
    ] = Path("app/static/media"),
) -> None:
    """Draw what the page shows of hands, as it is shipped.

    The synthetic operator that it plays when there is no camera, and how each gesture is held.
    """
    from app.gestures.drawings import write_drawings
    from app.gestures.synthetic import operator_clip

    (folder / "hands").mkdir(parents=True, exist_ok=True)
    write_drawings(folder / "hands")
    captions = operator_clip(folder / "operator.webm")
    rows = [caption._asdict() for caption in captions]
    (folder / "operator.json").write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    print(f"synthetic operator drawn in {folder}")


def enrol(
    name: Annotated[str, typer.Argument(help="Name of the new gesture.")],
    images: Annotated[list[Path], typer.Argument(help="One or more photos of the hand.")],
    action: Annotated[str, typer.Option(help='Action as JSON, such as \'{"type": "home"}\'.')],
    data_dir: DataDir = None,
    burst: Annotated[
        bool, typer.Option("--burst", help="The photos are frames of a few seconds: keep the best.")
    ] = False,
    inactive: Annotated[
        bool, typer.Option("--inactive", help="Enrol it, but do not match it yet.")
    ] = False,
    gallery: InGallery = SHARED_NAME,
) -> None:
    """Enrol a gesture from one or more photos, and say what it may be confused with."""
    from pydantic import ValidationError

    from app.gateway.enrolment import confusions_json
    from app.gateway.gallery import build_matcher
    from app.gestures.records import clean_name
    from app.link.actions import ACTION
    from app.pipeline import pack_template

    try:
        parsed = ACTION.validate_json(action)
    except ValidationError as error:
        first = error.errors()[0]
        raise Invalid(f"the action is not valid: {first['msg']}", action=action) from error
    settings = settings_for(data_dir=data_dir)
    name = clean_name(name)
    looks = _good_looks(images, settings, burst)
    templates = [pack_template(look.template) for look in looks if look.template is not None]
    landmarks = [None if look.hand is None else look.hand.pack() for look in looks]
    store = open_store(settings)
    try:
        into = store.galleries.named(gallery).id
        threshold = build_matcher(store, settings.pipeline, into).max_distance
        others = store.list(into)
        confusions = confusions_json(others, settings.pipeline, threshold, name, templates)
        gesture = store.create(
            name, parsed, templates, landmarks=landmarks, active=not inactive, gallery=into
        )
    finally:
        store.close()
    print(f"enrolled {gesture.name!r} with {len(templates)} samples{', inactive' * inactive}")
    for one in confusions:
        print(f"{one['level']} to be taken for {one['gesture']!r} ({one['strength']:.0%} as near):")
        for advice in one["advice"]:
            print(f"  {advice['message']}")


def _good_looks(images: list[Path], settings: "Settings", burst: bool) -> "list[Look]":
    """Photos that are good enough; prints what could be better.

    Raises:
        CannotStart: a file cannot be read.
        ImageRefused: a photo is refused, or no frame of a burst is good.
    """
    from app.pipeline.burst import choose, look_at, see

    looks = []
    for image in images:
        try:
            data = image.read_bytes()
        except OSError as error:
            raise CannotStart(f"{image} cannot be read: {error.strerror}") from error
        try:
            look = (look_at if burst else see)(data, settings.pipeline)
        except ImageRefused as error:
            error.message = f"{image}: {error.message}"
            raise
        looks.append(look)
    if burst:
        chosen = choose(looks, settings.pipeline)
        counts = ", ".join(f"{count} {code}" for code, count in chosen.left_out.items())
        counts = counts.replace("_", " ")
        if not chosen.kept:
            raise ImageRefused(f"none of the {len(images)} photos can be enrolled: {counts}")
        if counts:
            print(f"left out: {counts}")
        looks = [chosen.looks[number] for number in chosen.kept]
    else:
        for image, look in zip(images, looks, strict=True):
            for advice in look.advice:
                print(f"{image}: {advice.message}")
    return [look for look in looks if look.template is not None]
