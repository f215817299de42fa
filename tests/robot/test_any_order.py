"""The rules of lease and stops hold whatever happens in whatever order."""

from hypothesis import HealthCheck, settings

from tests.robot.any_order import AnyOrder

AnyOrder.TestCase.settings = settings(
    max_examples=60,
    stateful_step_count=20,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestAnyOrder = AnyOrder.TestCase
