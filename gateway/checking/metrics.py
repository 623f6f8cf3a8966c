"""Whether the port for Prometheus can be had."""

from __future__ import annotations

import socket

from gateway.checking.result import CheckResult
from gateway.config_sections import Metrics
from gateway.metrics.address import HOST, url, why


def check_metrics(metrics: Metrics) -> CheckResult:
    """Opens the port for a moment; nothing is served."""
    try:
        with socket.create_server((HOST, metrics.port)):
            return CheckResult("metrics", True, f"{url(metrics.port)} can be served")
    except OSError as error:
        remedy = f"name another as metrics.port; ss -ltnp 'sport = :{metrics.port}' shows who has it"
        return CheckResult("metrics", False, f"port {metrics.port} cannot be had: {why(error)}", remedy)
