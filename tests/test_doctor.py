"""What ``farhand doctor`` says when a part is missing. Times are among what it checks."""

from importlib.metadata import PackageNotFoundError
from pathlib import Path

import onnxruntime
import pytest

from app.config import Settings
from app.doctor import CHECKS, check_landmarks, check_networks, run_checks
from app.pipeline import features, mask, network
from app.pipeline.hand_landmarks import files


@pytest.fixture
def networks_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in set(CHECKS) - {"networks"}:
        monkeypatch.delitem(CHECKS, name)


def test_both_networks_answer() -> None:
    finding = check_networks(Settings())
    assert "mask by network takes" in finding.text


@pytest.mark.parametrize(("module", "name"), [(mask, "MODEL"), (features, "SHAPE_MODEL")])
def test_a_network_that_is_missing_is_named(
    networks_alone: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    module: object,
    name: str,
) -> None:
    monkeypatch.setattr(module, name, "gone.onnx")
    assert not run_checks(Settings())
    assert "FAIL networks    the network gone.onnx cannot be read" in capsys.readouterr().out


def test_a_network_that_is_broken_is_named(
    networks_alone: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    (tmp_path / "broken.onnx").write_bytes(b"not a network")
    monkeypatch.setattr(mask, "MODEL", str(tmp_path / "broken.onnx"))
    assert not run_checks(Settings())
    assert "FAIL networks    the network" in capsys.readouterr().out


def test_missing_landmarks_are_said_and_are_no_failure_unless_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    assert "found by landmarks" in check_landmarks(Settings()).text
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(files, "distribution", missing)
    finding = check_landmarks(Settings())
    assert finding.fine and "is missing, so hands are found by mask" in finding.text
    on = {"pipeline": {"landmarks": {"mode": "on"}}}
    assert not check_landmarks(Settings.model_validate(on)).fine


def test_a_network_is_read_once_and_runs_on_one_thread() -> None:
    session = network.load(mask.MODEL)
    assert network.load(mask.MODEL) is session
    assert isinstance(session, onnxruntime.InferenceSession)
    assert session.get_session_options().intra_op_num_threads == 1


def test_it_finds_nothing_wrong_here(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_checks(Settings(port=0, data_dir=tmp_path / "data"))
    found = capsys.readouterr().out
    assert "FAIL" not in found, found
    assert "robot node" in found
