from app.gateway.frame_age import FrameAge


def test_the_newest_tick_seen_bounds_the_age() -> None:
    age = FrameAge(500)
    assert age(10_000, 5.0, 10_500) is None
    assert age(10_000, 6.0, 10_501) == (
        "the frame is too old to move the robot: its sender had seen nothing newer than 501 ms "
        "ago, at most 500 ms are allowed"
    )
    assert age(10_502, 7.0, 10_501) == "the frame names a server tick that has not come yet"


def test_without_a_tick_a_burst_after_a_stall_is_too_old() -> None:
    age = FrameAge(500)
    for count in range(30):
        assert age(0, 1000.0 + 33 * count, 70_000 + 33 * count + count % 5) is None
    burst = [age(0, 2000.0 + 33 * count, 73_000) for count in range(60)]
    assert burst[0] == (
        "the frame is too old to move the robot: it came 2000 ms later than others did, at most "
        "500 ms are allowed"
    )
    assert [reason is None for reason in burst].index(True) == 46  # captured at most 500 ms before


def test_a_frame_that_tells_no_time_at_all_moves_nothing() -> None:
    age = FrameAge(500)
    age(0, 0.0, 100)
    told = age(0, 0.0, 133)
    assert told is not None and told.startswith("the frame's age is not known")
