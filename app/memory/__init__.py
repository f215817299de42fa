"""What the server remembers: a timeline, and people's settings. Driving needs none of it."""

from app.memory.database import Database, open_memory
from app.memory.events import KINDS, OPERATORS_KINDS, Event, Kind
from app.memory.settings import PersonSettings, SettingsStore
from app.memory.store import EventStore, Finish, NewEvent, Picture

__all__ = [
    "KINDS",
    "OPERATORS_KINDS",
    "Database",
    "Event",
    "EventStore",
    "Finish",
    "Kind",
    "NewEvent",
    "PersonSettings",
    "Picture",
    "SettingsStore",
    "open_memory",
]
