"""The gateway's configuration for a play: the vehicle's or the user's own, with the play's buses, link and files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import tomli_w

from gateway.config import Config, load
from hil_tests.scenario.document import Scenario

CONFIG, FINDINGS, KEY = "gateway.toml", "findings.jsonl", "mavlink.key"
HOST = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class Meeting:
    """Where the gateway meets the vehicle.

    Attributes:
        interface, channel: of the CAN bus, as python-can names them; None: as they are configured.
        endpoint: of the autopilot's link, as the gateway's configuration has it.
    """

    interface: str | None
    channel: str | None
    endpoint: str


def in_memory() -> Meeting:
    """No socket is opened: bus and link are in memory."""
    return Meeting("virtual", "can0", f"udpin:{HOST}:0")


def write_config(
    scenario: Scenario, text: str, folder: Path, meeting: Meeting, relative_to: Path
) -> tuple[Config, bytes | None]:
    """Writes the play's configuration into its folder, and reads it as the gateway does.

    Args:
        scenario: its `gateway.settings` are laid over.
        text: the configuration to begin with, TOML.
        folder: of the play, exists.
        meeting: replaces buses and link.
        relative_to: the folder that paths in `text` are relative to.

    Returns:
        The configuration, and the key that both ends sign with, if they do.

    Raises:
        ConfigError: it has problems.
        OSError: the folder cannot be written to.
    """
    tables = _laid_over(tomllib.loads(text), scenario.gateway.settings)
    for bus in tables.get("can", []):
        bus |= {key: value for key in ("interface", "channel") if (value := getattr(meeting, key)) is not None}
        if "database" in bus:
            bus["database"] = str((relative_to / bus["database"]).resolve())
    if "mavlink" in tables:
        tables["mavlink"]["endpoint"] = meeting.endpoint
    key = _key(tables, folder, scenario.seed) if scenario.gateway.signed else None
    tables["files"] = tables.get("files", {}) | {
        "findings": FINDINGS,
        "state": "vehicle.state",
        "control": "gateway.sock",
    }
    for stale in (FINDINGS, "vehicle.state"):
        (folder / stale).unlink(missing_ok=True)
    (folder / CONFIG).write_text(tomli_w.dumps(tables), encoding="utf-8")
    return load(folder / CONFIG), key


def _laid_over(tables: dict[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Table by table, key by key; what is no table replaces what was there, and None, null in YAML, takes it away."""
    merged = dict(tables)
    for key, value in settings.items():
        if value is None:
            merged.pop(key, None)
        elif isinstance(value, Mapping):
            below = merged.get(key)
            merged[key] = _laid_over(below if isinstance(below, dict) else {}, value)
        else:
            merged[key] = value
    return merged


def _key(tables: dict[str, Any], folder: Path, seed: int) -> bytes:
    """In a file that nobody else can read. A secret it is not: it follows from the seed, as all chance does."""
    key = sha256(f"scenario {seed}".encode()).digest()
    file = folder / KEY
    file.unlink(missing_ok=True)
    file.touch(mode=0o600)
    file.write_bytes(key)
    tables.setdefault("mavlink", {})["signing_key"] = KEY
    return key
