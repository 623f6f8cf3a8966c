"""The gateway's configuration for a play: the vehicle's or the user's own, with the play's buses, link and files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import tomli_w

from gateway.config import Config, load
from gateway.problems import ConfigError, Problem
from hil_tests.rig.profile import Profile
from hil_tests.scenario.document import Scenario

CONFIG, FINDINGS, KEY = "gateway.toml", "findings.jsonl", "mavlink.key"
HOST = "127.0.0.1"
# What a configuration names that lies elsewhere, beside the databases of its buses: table by table, then the key.
PATHS = (("mavlink", "signing_key"), ("speed", "flow", "file"), ("navigation", "lstm_model"))


@dataclass(frozen=True, slots=True)
class Meeting:
    """Where the gateway meets the vehicle.

    Attributes:
        interface, channel: of the CAN bus, as python-can names them; None: as they are configured.
        endpoint: of the autopilot's link, as the gateway's configuration has it.
        real_autopilot: it has the key of that configuration, if there is one; a simulated one gets a key of the play.
    """

    interface: str | None
    channel: str | None
    endpoint: str
    real_autopilot: bool = False


def in_memory() -> Meeting:
    """No socket is opened: bus and link are in memory."""
    return Meeting("virtual", "can0", f"udpin:{HOST}:0")


def config_text(scenario: Scenario, path: Path, profile: Profile) -> tuple[str, Path]:
    """The configuration to begin with, TOML, and the folder that paths in it are relative to.

    Args:
        scenario: whose own configuration goes before its vehicle's.
        path: of its file.
        profile: of its vehicle.

    Raises:
        OSError, UnicodeDecodeError: the scenario's own cannot be read.
    """
    if scenario.gateway.config is None:
        return profile.gateway_toml(), profile.folder
    file = path.parent / scenario.gateway.config
    return file.read_text(encoding="utf-8"), file.parent


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
    tables = _laid_over(tomllib.loads(text), deepcopy(scenario.gateway.settings))
    _resolve_paths(tables, relative_to)
    _meet(tables, meeting)
    key = _key(tables, folder, scenario.seed) if _play_signs(tables, scenario, meeting) else None
    tables["files"] = _table(tables, "files") | {
        "findings": FINDINGS,
        "state": "vehicle.state",
        "control": "gateway.sock",
    }
    tables.setdefault("recording", {"enabled": False})  # the play records itself, see `Recorder`
    for stale in (FINDINGS, "vehicle.state"):
        (folder / stale).unlink(missing_ok=True)
    (folder / CONFIG).write_text(_toml(tables), encoding="utf-8")
    return load(folder / CONFIG), key


def _resolve_paths(tables: dict[str, Any], folder: Path) -> None:
    """What is no table or path is left as it is, for the gateway to say so."""
    named = [(bus, "database") for bus in _buses(tables)]
    for *way, key in PATHS:
        table = tables
        for name in way:
            table = _table(table, name)
        named.append((table, key))
    for table, key in named:
        if isinstance(table.get(key), str):
            table[key] = str((folder / table[key]).resolve())


def _meet(tables: dict[str, Any], meeting: Meeting) -> None:
    """Raises ConfigError where a bus of the play would be several of the gateway's."""
    buses = _buses(tables)
    if meeting.channel is not None and len(buses) > 1:
        names = ", ".join(str(bus.get("name")) for bus in buses)
        wanted = "a play has one CAN bus: want one (gateway.settings: {can: [...]} replaces them)"
        raise ConfigError(CONFIG, [Problem("can", names, wanted)])
    replaced = {"interface": meeting.interface, "channel": meeting.channel}
    for bus in buses:
        bus |= {key: value for key, value in replaced.items() if value is not None}
    if "mavlink" in tables:
        _table(tables, "mavlink")["endpoint"] = meeting.endpoint


def _play_signs(tables: dict[str, Any], scenario: Scenario, meeting: Meeting) -> bool:
    return scenario.gateway.signed or ("signing_key" in _table(tables, "mavlink") and not meeting.real_autopilot)


def _table(tables: Mapping[str, Any], key: str) -> dict[str, Any]:
    """One of them; empty where there is none, or something else."""
    found = tables.get(key)
    return found if isinstance(found, dict) else {}


def _buses(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = tables.get("can")
    return [bus for bus in found if isinstance(bus, dict)] if isinstance(found, list) else []


def _toml(tables: Mapping[str, Any]) -> str:
    """Raises ConfigError for what YAML has and TOML has not: a null in a list."""
    try:
        return tomli_w.dumps(tables)
    except (TypeError, ValueError) as error:
        raise ConfigError(
            CONFIG, [Problem("gateway.settings", None, f"cannot be written as TOML: {error}")]
        ) from error


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
    tables.setdefault("mavlink", {})
    _table(tables, "mavlink")["signing_key"] = KEY
    return key
