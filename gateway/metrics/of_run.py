"""The metrics of a run, where its configuration asks for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from gateway.config_sections import Metrics
from gateway.telemetry import Telemetry

if TYPE_CHECKING:
    from gateway.metrics.server import MetricsServer


def metrics_server(settings: Metrics, telemetry: Callable[[], Telemetry]) -> MetricsServer:
    """What serves them; what that needs is loaded here, for most runs want none."""
    from gateway.metrics.exposition import Exposition
    from gateway.metrics.server import MetricsServer

    return MetricsServer(settings.port, Exposition(telemetry).text)
