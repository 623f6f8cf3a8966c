"""The one configuration file: a TOML text in, a frozen `Config` out, or every problem of it in one go.

Its tables are in `gateway.config_sections`. Relative paths in the file are relative to the folder that it lies in.
`examples/` has commented files to start from.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from detectors.navigation import NavigationConfig
from detectors.speed import SpeedConfig
from detectors.thruster import ThrusterConfig
from gateway.config_sections import (
    MAVLINK,
    Align,
    CanBus,
    Failsafe,
    Files,
    Mavlink,
    Metrics,
    Navigation,
    Recording,
    Section,
    Speed,
    Supervisor,
    Thruster,
    Vehicle,
)
from gateway.consistency import inconsistencies
from gateway.detector_settings import DetectorSettings
from gateway.forwarded_can_settings import sampled
from gateway.navigation_settings import navigation_settings
from gateway.problems import ConfigError, Problem, from_validation, unknown_key
from gateway.speed_settings import speed_settings

SectionT = TypeVar("SectionT", bound=Section)
SettingsT = TypeVar("SettingsT")


@dataclass(frozen=True, slots=True)
class Detectors:
    """Settings of the detectors.

    Attributes:
        thruster: of every thruster's.
        speed: of the vehicle's speed, None = not watched.
        navigation: of the navigation sensors, None = not watched.
    """

    thruster: ThrusterConfig
    speed: SpeedConfig | None
    navigation: NavigationConfig | None


@dataclass(frozen=True, slots=True)
class Config:
    """A valid configuration.

    Attributes:
        vehicle: the vehicle's name.
        can: CAN buses.
        mavlink: the link to the autopilot, None = none.
        thruster: thrusters, in the order of the file.
        speed: the speed watch, None = none.
        navigation: the navigation watch, None = none.
        detector: settings of the detectors.
        align, supervisor, failsafe: as in the file, with defaults filled in.
        files: with absolute paths.
        recording: with an absolute folder.
        metrics: what is served to Prometheus, None = nothing.
        text: the file's.
    """

    vehicle: Vehicle
    can: tuple[CanBus, ...]
    mavlink: Mavlink | None
    thruster: tuple[Thruster, ...]
    speed: Speed | None
    navigation: Navigation | None
    detector: Detectors
    align: Align
    supervisor: Supervisor
    failsafe: Failsafe
    files: Files
    recording: Recording
    metrics: Metrics | None
    text: str

    def bus(self, name: str) -> CanBus | None:
        """The CAN bus of that name."""
        return next((bus for bus in self.can if bus.name == name), None)

    def alignment(self, thruster: Thruster) -> Align:
        """How commands and speeds of a thruster become samples: see `gateway.forwarded_can_settings.sampled`."""
        links = {thruster.command.link, thruster.rpm.link}
        return sampled(self.align) if any(bus.forwarded and bus.name in links for bus in self.can) else self.align

    def links(self) -> list[str]:
        """Names of all links."""
        return [bus.name for bus in self.can] + ([MAVLINK] if self.mavlink else [])

    def watched(self) -> str:
        """Whatever is watched, in words."""
        watched = [f"thrusters {', '.join(str(thruster.number) for thruster in self.thruster)}"]
        watched += ["speed"] if self.speed is not None else []
        watched += ["navigation"] if self.navigation is not None else []
        return " and ".join(filter(None, [", ".join(watched[:-1]), watched[-1]]))


def load(path: Path | str) -> Config:
    """Reads and checks a configuration file.

    Raises:
        ConfigError: it cannot be read, is no TOML, or has problems; it lists all of them.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(path), [Problem(str(path), None, f"cannot be read: {error}")]) from error
    return parse(text, path.resolve().parent, str(path))


def parse(text: str, folder: Path, source: str = "configuration") -> Config:
    """Checks a configuration text.

    Args:
        text: TOML.
        folder: what relative paths in it are relative to.
        source: what error messages call it.

    Raises:
        ConfigError: see `load`.
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # numbers of thousands of digits, tables in tables without end
        raise ConfigError(source, [Problem(source, None, f"not valid TOML: {error}")]) from error
    return _Parser(tables, folder).config(source, text)


class _Parser:
    """Goes through all tables, however many problems there are, so that none hides another."""

    def __init__(self, tables: dict[str, Any], folder: Path) -> None:
        self._tables = tables
        self._folder = folder
        self._problems: list[Problem] = []

    def config(self, source: str, text: str) -> Config:
        known = [field.name for field in fields(Config) if field.name != "text"]
        self._problems += [unknown_key(key, value, known) for key, value in self._tables.items() if key not in known]
        parts = {
            "vehicle": self._section(Vehicle, "vehicle", required=True),
            "can": tuple(self._each(CanBus, "can", "name")),
            "mavlink": self._section(Mavlink, "mavlink") if "mavlink" in self._tables else None,
            "thruster": tuple(self._each(Thruster, "thruster", "number")),
            "speed": self._section(Speed, "speed") if "speed" in self._tables else None,
            "navigation": self._section(Navigation, "navigation") if "navigation" in self._tables else None,
            "align": self._section(Align, "align"),
            "supervisor": self._section(Supervisor, "supervisor"),
            "failsafe": self._section(Failsafe, "failsafe"),
            "files": self._section(Files, "files"),
            "recording": self._section(Recording, "recording"),
            "metrics": self._section(Metrics, "metrics") if "metrics" in self._tables else None,
        }
        return self._checked({**parts, "text": text}, source)

    def _checked(self, parts: dict[str, Any], source: str) -> Config:
        if parts["files"] is not None:
            parts["files"] = self._absolute(parts["files"], "findings", "state", "control")
        if parts["recording"] is not None:
            parts["recording"] = self._absolute(parts["recording"], "folder")
        parts["can"] = tuple(self._absolute(bus, "database") for bus in parts["can"])
        if parts["mavlink"] is not None:
            parts["mavlink"] = self._absolute(parts["mavlink"], "signing_key")
        if parts["speed"] is not None and parts["speed"].flow is not None:
            flow = self._absolute(parts["speed"].flow, "file")
            parts["speed"] = parts["speed"].model_copy(update={"flow": flow})
        if parts["navigation"] is not None:
            parts["navigation"] = self._absolute(parts["navigation"], "lstm_model")
        crossed = {key: parts[key] for key in ("can", "mavlink", "thruster", "speed", "navigation", "failsafe")}
        self._problems += inconsistencies(self._tables, **crossed)
        parts["detector"] = self._detectors(parts["speed"], parts["navigation"])
        if self._problems:
            raise ConfigError(source, self._problems)
        return Config(**parts)

    def _absolute(self, section: SectionT, *keys: str) -> SectionT:
        paths = {key: self._folder / path for key in keys if (path := getattr(section, key)) is not None}
        return section.model_copy(update=paths)

    def _section(self, model: type[SectionT], key: str, required: bool = False) -> SectionT | None:
        if required and key not in self._tables:
            self._problems.append(Problem(key, None, f"missing: want a table [{key}]"))
            return None
        return self._validated(model, self._tables.get(key, {}), key)

    def _each(self, model: type[SectionT], key: str, identity: str) -> list[SectionT]:
        tables = self._tables.get(key, [])
        if not (isinstance(tables, list) and all(isinstance(table, dict) for table in tables)):
            self._problems.append(Problem(key, tables, f"should be tables, each under [[{key}]]"))
            return []
        paths = [f"{key}[{_called(table, identity, number)}]" for number, table in enumerate(tables)]
        sections = [self._validated(model, table, path) for path, table in zip(paths, tables, strict=True)]
        return [section for section in sections if section is not None]

    def _validated(self, model: type[SectionT], table: object, path: str) -> SectionT | None:
        try:
            return model.model_validate(table)
        except ValidationError as error:
            self._problems += from_validation(error, model, path)
            return None

    def _detectors(self, speed: Speed | None, navigation: Navigation | None) -> Detectors | None:
        tables = self._tables.get("detector", {})
        if not isinstance(tables, dict):
            self._problems.append(Problem("detector", tables, "should be a table, [detector.thruster]"))
            return None
        known = ("thruster", "speed", "navigation")
        unknown = {key: value for key, value in tables.items() if key not in known}
        self._problems += [unknown_key(f"detector.{key}", value, known) for key, value in unknown.items()]
        thruster = self._told(
            DetectorSettings(ThrusterConfig, "detector.thruster", {}).read(tables.get("thruster", {}))
        )
        speeding = None if speed is None else self._told(speed_settings(speed, tables.get("speed", {})))
        navigating = (
            None if navigation is None else self._told(navigation_settings(navigation, tables.get("navigation", {})))
        )
        return None if thruster is None else Detectors(thruster, speeding, navigating)

    def _told(self, found: tuple[SettingsT | None, list[Problem]]) -> SettingsT | None:
        settings, problems = found
        self._problems += problems
        return settings


def _called(table: dict[str, Any], identity: str, number: int) -> str:
    """What tells a table from others of its kind, else its number in the file."""
    try:
        return f"{identity}={table[identity]}"
    except (KeyError, ValueError):  # Python shows no integer of thousands of digits
        return str(number)
