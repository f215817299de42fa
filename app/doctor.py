"""``farhand doctor``: what Farhand needs of this machine, checked by using it."""

import os
import platform
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.config import Settings
from app.errors import FarhandError

_NODE_START_S = 20.0
_RENDER_S = 2.0
_RENDER_FPS_WANTED = 20
"""Pictures a second from each of two cameras; below that driving by picture feels late."""
_MASK_MS_WANTED = 100
"""Longest for one mask by the network; three of them have to agree before a gesture starts."""


class Finding(NamedTuple):
    """What one check found."""

    fine: bool
    text: str
    mend: str = ""
    """What to do about it, when it is not fine."""


def check_python(settings: Settings) -> Finding:
    """The interpreter PyBullet has wheels for, and enough cores."""
    cores = os.cpu_count() or 1
    text = f"Python {platform.python_version()} on {platform.machine()}, {cores} cores"
    if sys.version_info[:2] != (3, 11):
        return Finding(False, text, "use Python 3.11: PyBullet has no wheels for newer ones")
    if cores < 2:
        return Finding(False, text, "two cores are needed: one for control, one for pictures")
    return Finding(True, text)


def check_pybullet(settings: Settings) -> Finding:
    """PyBullet hands pictures over as arrays, not as tuples of a million numbers."""
    from app.robot.sim.arm import SimulatedArm

    SimulatedArm(objects=False).close()
    return Finding(True, "PyBullet runs, with numpy")


def check_renderer(settings: Settings) -> Finding:
    """Both cameras rendered as the camera process does, and how fast."""
    from app.robot.sim.arm import SimulatedArm
    from app.robot.sim.renderer import Renderer

    arm = SimulatedArm()
    renderer = Renderer()
    now = arm.read()
    rounds = 0
    began = time.monotonic()
    while time.monotonic() - began < _RENDER_S:
        # A joint that moves, since what stands still is not drawn anew.
        joints = now.joints + 0.01 * rounds
        renderer.update(joints, now.gripper, now.objects)
        for name in renderer.names:
            renderer.picture(name)
        rounds += 1
    rate = rounds / (time.monotonic() - began)
    by = "the graphics card" if renderer.hardware else "software"
    renderer.close()
    arm.close()
    text = f"both cameras {rate:.0f} times a second, by {by}"
    if rate < _RENDER_FPS_WANTED:
        return Finding(False, text, "pictures will lag: use a faster machine or a graphics card")
    return Finding(True, text)


def check_codecs(settings: Settings) -> Finding:
    """JPEG both ways, PNG, and the video format of the demonstration."""
    import cv2
    import simplejpeg

    picture = np.tile(np.arange(160, dtype=np.uint8), (120, 1))
    colour = np.ascontiguousarray(np.stack([picture] * 3, axis=-1))
    again = simplejpeg.decode_jpeg(simplejpeg.encode_jpeg(colour, quality=90))
    if np.abs(again.astype(int) - colour).mean() > 3:
        return Finding(False, "JPEG does not survive a round trip", "reinstall simplejpeg")
    if not cv2.imencode(".png", picture)[0] or not cv2.imencode(".webp", picture)[0]:
        return Finding(False, "OpenCV cannot write PNG or WebP", "reinstall opencv-python-headless")
    with tempfile.TemporaryDirectory() as folder:
        writer = cv2.VideoWriter(
            str(Path(folder) / "check.webm"), cv2.VideoWriter.fourcc(*"VP80"), 15, (160, 120)
        )
        opened = writer.isOpened()
        writer.release()
    if not opened:
        return Finding(
            False,
            "OpenCV cannot write WebM, so the demonstration without a camera does not play",
            "install opencv-python-headless from its wheel, which brings FFmpeg",
        )
    return Finding(True, "JPEG, PNG, WebP and WebM work")


def check_networks(settings: Settings) -> Finding:
    """Both networks load, make what they should of one picture, and are fast enough."""
    from app.config import MatchSettings
    from app.pipeline.features import Features
    from app.pipeline.mask import LearnedMask

    picture = np.tile(np.arange(160, dtype=np.uint8)[:, None], (120, 1, 3))
    find_hand = LearnedMask()
    find_hand(picture)
    began = time.monotonic()
    # Turned round, or it would stand for the picture before.
    mask = find_hand(np.ascontiguousarray(picture[:, ::-1])).mask
    took = (time.monotonic() - began) * 1e3
    view = np.zeros((1, 40, 30), np.uint8)
    view[:, 10:, 10:20] = 1
    numbers = Features(MatchSettings(features="shape"))(view)[0, view.size :]
    if mask.shape != picture.shape[:2] or not np.isfinite(numbers).all() or not numbers.any():
        return Finding(False, "the networks answer nonsense", "install onnxruntime anew")
    text = f"the hand's mask by network takes {took:.0f} ms"
    if took > _MASK_MS_WANTED:
        return Finding(False, text, "gestures in rooms will lag: use a faster machine")
    return Finding(True, text)


def check_landmarks(settings: Settings) -> Finding:
    """MediaPipe's networks are here and run; without them hands are found by mask, which works."""
    from app.pipeline.hand_landmarks.files import find
    from app.pipeline.hand_landmarks.tracker import HandTracker

    mine = settings.pipeline.landmarks
    if mine.mode == "off":
        return Finding(True, "hands are found by mask: the settings say so")
    found = (
        find("palm", mine.palm, mine.folder),
        find("hand", mine.hand, mine.folder),
        find("palm", "full", mine.folder),
        find("hand", "full", mine.folder),
    )
    missing = [one for one in found if one.path is None]
    if missing:
        why = missing[0].why_not or f"{missing[0].model.name} is missing"
        text = f"{why}, so hands are found by mask"
        return Finding(mine.mode == "auto", text, "run: farhand models add")
    track = HandTracker(mine)
    picture = np.full((480, 640, 3), 128, np.uint8)
    track(picture)
    began = time.monotonic()
    track(picture)
    took = (time.monotonic() - began) * 1e3
    if took > _MASK_MS_WANTED:
        return Finding(False, f"to look for a hand takes {took:.0f} ms", "use a faster machine")
    return Finding(True, f"hands are found by landmarks; to look for one takes {took:.0f} ms")


def check_port(settings: Settings) -> Finding:
    """The port can be listened on."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((settings.host, settings.port))
        except OSError as error:
            return Finding(
                False,
                f"{settings.host}:{settings.port} cannot be listened on: {error.strerror}",
                "stop what uses it, or choose another with --port",
            )
    return Finding(True, f"{settings.host}:{settings.port} is free")


def check_database(settings: Settings) -> Finding:
    """The gesture database opens; a missing one is made from the starter set, elsewhere."""
    from app.gateway.gallery import open_store, place_of
    from app.gestures.recovery import how, problem

    if settings.database_url is None and not settings.data_dir.exists():
        with tempfile.TemporaryDirectory() as folder:
            store = open_store(settings.model_copy(update={"data_dir": Path(folder)}))
            count = len(store.list())
            store.close()
        return Finding(True, f"no database yet; a new one will hold {count} starter gestures")
    store = open_store(settings)
    count = len(store.list())
    store.close()
    place = place_of(settings)
    if place is not None and problem(place) is not None:
        lost = "the gesture database was lost; the robot cannot be armed"
        return Finding(False, lost, how(place))
    return Finding(True, f"the gesture database holds {count} gestures")


def check_node(settings: Settings) -> Finding:
    """A robot node of its own starts, describes itself, reports its state and can be stopped."""
    from app.link.gateway_end import GatewayEnd
    from app.link.messages import StopRequest
    from app.link.session import socket_endpoint

    with tempfile.TemporaryDirectory(prefix="farhand-") as folder:
        endpoint = socket_endpoint(Path(folder) / "node.sock")
        began = time.monotonic()
        node = subprocess.Popen(
            [sys.executable, "-m", "app.robot.node", "--id", "doctor", "--endpoint", endpoint],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            with GatewayEnd("doctor", endpoint, timeout=_NODE_START_S) as link:
                _wait(lambda: link.state is not None, _NODE_START_S)
                started = time.monotonic() - began
                name = link.describe(timeout=5.0).name
                asked = time.monotonic()
                link.stop(StopRequest(source="doctor", reason="a check"))
                _wait(lambda: link.state is not None and link.state.mode == "stopped", 5.0)
                stopped = time.monotonic() - asked
        finally:
            node.terminate()
            node.wait(10)
    return Finding(
        True,
        f"a node of {name} answers after {started:.1f} s and stops after {stopped * 1e3:.0f} ms",
    )


def _wait(condition: Callable[[], bool], seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"no answer within {seconds:g} s")
        time.sleep(0.005)


CHECKS: dict[str, Callable[[Settings], Finding]] = {
    "python": check_python,
    "pybullet": check_pybullet,
    "renderer": check_renderer,
    "codecs": check_codecs,
    "networks": check_networks,
    "landmarks": check_landmarks,
    "port": check_port,
    "database": check_database,
    "robot node": check_node,
}


def run_checks(settings: Settings) -> bool:
    """Run all checks and print a line each. Returns whether everything is fine."""
    all_fine = True
    for name, check in CHECKS.items():
        try:
            finding = check(settings)
        except FarhandError as error:
            finding = Finding(False, error.message)
        except (ImportError, OSError, TimeoutError, subprocess.SubprocessError) as error:
            finding = Finding(
                False, f"{type(error).__name__}: {error}", "run `make run` again to set up anew"
            )
        all_fine &= finding.fine
        print(f"{'ok  ' if finding.fine else 'FAIL'} {name:11} {finding.text}", flush=True)
        if finding.mend:
            print(f"{'':16} -> {finding.mend}")
    return all_fine
