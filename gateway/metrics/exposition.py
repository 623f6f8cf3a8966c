"""What Prometheus reads: the text of all metrics at the moment of a scrape, those of the process itself included."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.metadata import version

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from gateway.metrics.families import families
from gateway.telemetry import Telemetry

DISTRIBUTION = "thruster-gateway"
CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"


class Exposition:
    """See the module's text. Its registry is its own: whatever else this process counts is not in it.

    Args:
        telemetry: how the gateway is now.
    """

    def __init__(self, telemetry: Callable[[], Telemetry]) -> None:
        self._registry = CollectorRegistry()
        self._registry.register(_Gateway(telemetry))
        ProcessCollector(registry=self._registry)

    def text(self) -> bytes:
        """In Prometheus's text format (`CONTENT_TYPE`)."""
        return generate_latest(self._registry)


class _Gateway(Collector):
    def __init__(self, telemetry: Callable[[], Telemetry]) -> None:
        self._telemetry, self._version = telemetry, version(DISTRIBUTION)

    def collect(self) -> Iterable[Metric]:
        return families(self._telemetry(), self._version)
