"""The gesture database, its exchange format, and the hand that draws the starter set."""

from app.gestures.exchange import export_set, import_set
from app.gestures.png import read_template, template_png
from app.gestures.records import Gesture, NewGesture, Sample
from app.gestures.setfile import read_set
from app.gestures.setwriter import write_set
from app.gestures.store import GestureStore

__all__ = [
    "Gesture",
    "GestureStore",
    "NewGesture",
    "Sample",
    "export_set",
    "import_set",
    "read_set",
    "read_template",
    "template_png",
    "write_set",
]
