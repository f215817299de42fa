"""What people chose: validated, bounded, the last one wins."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import ValidationError

from app.memory import Database, PersonSettings, SettingsStore
from app.memory.settings import MAX_PEOPLE


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "memory.db"


@pytest.fixture
def database(path: Path) -> Iterator[Database]:
    made = Database(path)
    yield made
    made.close()


def test_choices_are_merged_forgotten_and_kept_over_a_restart(
    database: Database, path: Path
) -> None:
    store = SettingsStore(database)
    assert store.get("ann") == PersonSettings()
    store.change("ann", {"speed": 0.3, "language": "de"}, 1)
    changed = store.change("ann", {"speed": 0.5, "glass": True}, 2)
    assert changed == PersonSettings(speed=0.5, glass=True, language="de")
    assert store.change("ann", {"glass": None}, 3).glass is None
    other = Database(path)
    assert SettingsStore(other).get("ann") == PersonSettings(speed=0.5, language="de")
    assert SettingsStore(other).get("ben") == PersonSettings()
    other.close()


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": 1.01}, {"speed": 0.04}, {"speed": float("nan")}, {"speed": "0.5"},
        {"fine": "yes"}, {"fine": 1}, {"large": "roof"}, {"glass": 0}, {"language": "DE"},
        {"language": "x" * 40}, {"language": "de\n"}, {"source": "again"}, {"armed": True},
    ],
)  # fmt: skip
def test_what_is_no_choice_changes_nothing(database: Database, changes: dict[str, object]) -> None:
    store = SettingsStore(database)
    store.change("ann", {"speed": 0.3}, 1)
    with pytest.raises(ValidationError):
        store.change("ann", {"fine": True, **changes}, 2)
    assert store.get("ann") == PersonSettings(speed=0.3)


def test_what_another_version_wrote_counts_as_not_chosen(database: Database) -> None:
    with database.write() as connection:
        data = '{"speed":7,"colour":"red","fine":true}'
        connection.execute("INSERT INTO settings VALUES ('ann', 1, ?)", (data,))
    store = SettingsStore(database)
    assert store.get("ann") == PersonSettings(fine=True)
    assert store.change("ann", {"glass": True}, 2) == PersonSettings(fine=True, glass=True)


def test_people_are_bounded_and_forgotten(database: Database) -> None:
    store = SettingsStore(database)
    for number in range(MAX_PEOPLE + 5):
        store.change(f"person {number}", {"fine": True}, number)
    assert store.get("person 4") == PersonSettings()
    assert store.get("person 5").fine
    store.keep_only({"person 5", "person 6"})
    assert store.get("person 7") == PersonSettings()
    store.forget("person 6")
    assert store.get("person 6") == PersonSettings()
    assert store.get("person 5").fine
