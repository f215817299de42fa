import zipfile
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

from app.config import PipelineSettings
from app.errors import CannotStart, Invalid
from app.pipeline.hand_landmarks import files
from app.pipeline.hand_landmarks.live import ByLandmarks, wanted


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A machine without any network; gives the user's own folder for them."""

    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(files, "distribution", missing)
    return tmp_path / "farhand" / "models"


def test_every_network_is_on_this_machine() -> None:
    assert all(found.path is not None for found in files.all_found().values())


def test_the_wheels_are_pinned_by_hash_and_nothing_else_is_in_the_lock() -> None:
    lines = [line for line in files.lock_file().read_text().splitlines() if line[0] != "#"]
    named = [line for line in lines if not line.startswith(" ")]
    assert [line.split("==")[0] for line in named] == ["mediapipe", "mediapipe"]
    assert all("--hash=sha256:" in line for line in lines if line.startswith(" "))


def test_without_networks_hands_are_found_by_mask_and_what_is_missing_is_said(
    nowhere: Path,
) -> None:
    settings = PipelineSettings()
    assert not wanted(settings)
    assert ByLandmarks.where_wanted(settings) is None
    on = PipelineSettings.model_validate({"landmarks": {"mode": "on"}})
    with pytest.raises(CannotStart, match=r"palm_detection_lite.*farhand models add brings it"):
        ByLandmarks.where_wanted(on)


def test_they_are_taken_from_a_wheel_into_the_users_folder(nowhere: Path, tmp_path: Path) -> None:
    wheel = tmp_path / "some.whl"
    source = Path(str(distribution("mediapipe").locate_file("")))
    with zipfile.ZipFile(wheel, "w") as archive:
        for model in files.MODELS.values():
            archive.write(source / model.path, model.path)
    written = files.take_from(wheel, nowhere)
    assert {path.name for path in written} == {model.name for model in files.MODELS.values()}
    assert all(found.path in written for found in files.all_found().values())
    assert wanted(PipelineSettings())


def test_another_file_than_the_pinned_one_is_not_used(nowhere: Path, tmp_path: Path) -> None:
    nowhere.mkdir(parents=True)
    (nowhere / "hand_landmark_lite.tflite").write_bytes(b"another")
    assert "is another file" in files.find("hand", "lite").why_not
    with pytest.raises(CannotStart, match="is another file than the one pinned"):
        files.path_of("hand", "lite")
    (tmp_path / "no.whl").write_bytes(b"no zip")
    with pytest.raises(Invalid, match=r"no mediapipe/.* in .*no\.whl"):
        files.take_from(tmp_path / "no.whl", nowhere)


def test_the_folder_of_the_settings_comes_first(nowhere: Path, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    assert files.find("palm", "lite", tmp_path / "mine").path is None
