"""A person before the webcam, for whom a rendered hand is shown in the browser."""

import base64
import json
from pathlib import Path

import cv2
import numpy as np

from app.gestures.hand.poses import POSES
from app.gestures.hand.render import HandLook, HandSprite, HandView, render_sprite, through_lens

_VIEW = HandView(300.0, (640 * 0.53, 240.0), turn=0.04)
_LOOK = HandLook(blur=0.7)


def person_script() -> str:
    """JavaScript that runs before the page's own; see person.js."""
    hands = json.dumps({name: _picture(name) for name in POSES})
    code = (Path(__file__).parent / "person.js").read_text()
    return f"const HANDS = {hands};\n{code}"


def _picture(name: str) -> str:
    """The hand alone, 640x480, as a data URL of a PNG with alpha."""
    sprite = render_sprite(POSES[name], (640, 480), _VIEW, _LOOK, fine=1)
    colour, cover = HandSprite(*(through_lens(plane, _LOOK) for plane in sprite))
    plain = colour / np.maximum(cover, 1e-3)[..., None]
    picture = np.dstack([plain, cover * 255]).round().clip(0, 255).astype(np.uint8)
    done, data = cv2.imencode(".png", picture)
    assert done
    return "data:image/png;base64," + base64.b64encode(data.tobytes()).decode()
