"""The cube into the tray by gestures alone, by a virtual clock: whatever else the machine does."""

from benchmarks.pick_and_place import ASKED_S, virtual_run


def test_the_cube_is_put_into_the_tray_and_in_time() -> None:
    run = virtual_run(4)
    assert run.failure is None
    assert run.seconds < ASKED_S
    assert list(run.phases)[-1] == "open"
