"""What Prometheus reads at /metrics. One registry an app, so that tests do not share counters."""

from collections.abc import Callable, Iterable

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from app import logs

_STAGE_BUCKETS = (0.0002, 0.0005, 0.001, 0.002, 0.004, 0.006, 0.01, 0.02, 0.05, 0.1, 0.5)


class _Live(Collector):
    """Values that are read when asked for."""

    def __init__(self, read: Callable[[], Iterable[tuple[str, str, float | None]]]) -> None:
        self._read = read

    def collect(self) -> Iterable[Metric]:
        """All values that exist now: (name, help, value)."""
        for name, text, value in self._read():
            if value is not None:
                yield GaugeMetricFamily(name, text, value=value)


class _LogLines(Collector):
    """What nobody read of the log."""

    def collect(self) -> Iterable[Metric]:
        """The one counter."""
        text = "Lines of the gateway's log dropped because nobody read them in time"
        yield CounterMetricFamily("farhand_log_lines_dropped", text, value=logs.dropped())


class Metrics:
    """The gateway's counters. Safe to use from any thread."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        PlatformCollector(registry=self._registry)
        self._registry.register(_LogLines())
        registry = self._registry
        self.frames = Counter(
            "farhand_frames", "Webcam frames by what became of them", ["outcome"], registry=registry
        )
        for outcome in ("processed", "refused", "replaced", "out_of_order"):
            self.frames.labels(outcome)
        self.stages = Histogram(
            "farhand_stage_seconds",
            "Time of each stage of a frame",
            ["stage"],
            buckets=_STAGE_BUCKETS,
            registry=registry,
        )
        self.bad_messages = Counter(
            "farhand_bad_messages", "Messages refused, by code", ["code"], registry=registry
        )
        self.commands = Counter("farhand_commands", "Commands sent to the robot", registry=registry)
        self.stops = Counter(
            "farhand_stops", "Stops asked for, by where", ["source"], registry=registry
        )
        for source in ("gesture", "button", "rest"):
            self.stops.labels(source)
        self.pictures = Counter(
            "farhand_camera_pictures", "Camera pictures received", ["camera"], registry=registry
        )

    def frame_times(self, timing_ms: dict[str, float]) -> None:
        """Add the times of one processed frame, by stage, in ms."""
        for stage, milliseconds in timing_ms.items():
            self.stages.labels(stage).observe(milliseconds / 1000)

    def add_live(self, read: Callable[[], Iterable[tuple[str, str, float | None]]]) -> None:
        """Add gauges that are read when Prometheus asks."""
        self._registry.register(_Live(read))

    def text(self) -> bytes:
        """Everything in Prometheus' text format."""
        return generate_latest(self._registry)
