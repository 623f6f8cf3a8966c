"""The options that all parts of the benchmark have, and its figures as JSON."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Callable
from dataclasses import asdict, is_dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console

PACKAGES = ("numpy", "scipy", "filterpy", "dronecan", "cantools", "python-can", "pymavlink")
Command = TypeVar("Command", bound=Callable[..., object])

_jobs = click.option(
    "--jobs", type=click.IntRange(min=1), default=os.cpu_count() or 1, show_default=True, help="Processes."
)
_json = click.option(
    "--json", "json_file", type=click.Path(dir_okay=False, allow_dash=True), help="Write the figures, too."
)


def shared_options(command: Command) -> Command:
    """`--jobs` and `--json`."""
    return _jobs(_json(command))


def console_beside(json_file: str | None) -> Console:
    """Where tables go: not where the figures go."""
    return Console(stderr=json_file == "-")


def write(parts: dict[str, Any], file: str | None) -> None:
    """Each part's figures under its name, with what they were measured on; to standard output for `-`."""
    if file is None:
        return
    machine = {"python": platform.python_version(), "processors": os.cpu_count(), "architecture": platform.machine()}
    packages = {name: version(name) for name in PACKAGES}
    text = json.dumps(_plain({**parts, "machine": machine, "packages": packages}), indent=2, allow_nan=False)
    if file == "-":
        click.echo(text)
    else:
        Path(file).write_text(text + "\n", encoding="utf-8")


def _name(key: Any) -> str:
    return ", ".join(map(str, key)) if isinstance(key, tuple) else str(key)


def _plain(value: Any) -> Any:
    """What JSON knows: what is not a number, or without end, is null."""
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, dict):
        return {_name(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Path):
        return str(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
