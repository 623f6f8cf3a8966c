"""What a report was made with."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import version

PACKAGES = ("thruster-gateway", "numpy", "scipy", "pymavlink", "python-can", "cantools", "plotly")


def versions() -> Mapping[str, str]:
    """Of this program, of Python, and of what its figures depend on, by name."""
    return {name: version(name) for name in PACKAGES} | {"Python": platform.python_version()}
