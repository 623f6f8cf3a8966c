"""Where Prometheus finds the metrics: on this machine only, for whoever reads them reads how the vehicle is."""

from __future__ import annotations

import os

HOST = "127.0.0.1"
PATH = "/metrics"


def url(port: int) -> str:
    """To be asked on this machine."""
    return f"http://{HOST}:{port}{PATH}"


def why(error: OSError) -> str:
    """Why the port cannot be had; asyncio and socket say it in more words than there is use for."""
    return str(error) if error.errno is None else os.strerror(error.errno)
