"""The one configuration file: a TOML text in, a frozen `Config` out, or every problem of it in one go.

Relative paths in the file are relative to the folder that it lies in. `examples/` has commented files to start from.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from detectors.thruster import ThrusterConfig
from drivers.can.dbc import SpeedUnit
from gateway.detector_settings import thruster_settings
from gateway.problems import ConfigError, Problem, from_validation, unknown_key

MAVLINK = "mavlink"

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
PathText = Annotated[Path, Strict(False)]
SectionT = TypeVar("SectionT", bound="Section")


class Section(BaseModel):
    """A table of the file. A key that is not listed in it is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Vehicle(Section):
    """`[vehicle]`"""

    name: str = Field(min_length=1, description='what the logs call the vehicle, e.g. "BlueROV2 Heavy"')


class CanBus(Section):
    """`[[can]]`: one CAN bus."""

    name: str = Field(pattern=r"^[A-Za-z0-9_-]{1,16}$", description='what the thrusters call this bus, e.g. "can0"')
    interface: str = Field("socketcan", description='a python-can interface, e.g. "socketcan", "virtual", "slcan"')
    channel: str = Field(min_length=1, description='the channel of that interface, e.g. "can0"')
    protocol: Literal["dronecan", "dbc"] = Field(description="what the frames mean")
    database: PathText | None = Field(None, description='protocol "dbc": the DBC file')
    bitrate: int | None = Field(
        None, gt=0, description="bit/s, for interfaces that set it; SocketCAN's is set by `ip link`"
    )


class Mavlink(Section):
    """`[mavlink]`: the link to the autopilot."""

    endpoint: str = Field(
        description='"udpin:HOST:PORT", "udpout:HOST:PORT", "tcp:HOST:PORT" or "serial:DEVICE:BAUD"'
    )
    component_id: int = Field(
        192, ge=1, le=250, description="our own component; 192 is MAV_COMP_ID_ONBOARD_COMPUTER2"
    )
    # 255 is the ground station's: a companion that uses it silently disables ArduSub's GCS failsafe
    system_id: int | None = Field(
        None, ge=1, le=254, description="the vehicle's system; left out: the one autopilot seen"
    )


class CommandSource(Section):
    """`command = { ... }`: where the command of a thruster is read."""

    link: str = Field(description='name of a [[can]] bus, or "mavlink"')
    esc_index: int | None = Field(None, ge=0, le=19, description="DroneCAN: place in esc.RawCommand, from 0")
    bidirectional: bool = Field(True, description="DroneCAN: False where 0..8191 is idle to full ahead")
    servo_channel: int | None = Field(None, ge=1, le=32, description="MAVLink: output in SERVO_OUTPUT_RAW, from 1")
    signal: str | None = Field(None, pattern=r"^\w+\.\w+$", description='DBC: "Message.signal"')
    minimum: float | None = Field(None, description="full astern (or idle), in the unit of the wire: us, %, V")
    neutral: float | None = Field(None, description="no thrust, in the unit of the wire")
    maximum: float | None = Field(None, description="full ahead, in the unit of the wire")
    dead_band: NotNegative | None = Field(None, description="around neutral, in which the thruster stands still")
    reverse: bool = Field(False, description="True where a value above neutral drives astern")


class RpmSource(Section):
    """`rpm = { ... }`: where the speed of a thruster is read."""

    link: str = Field(description='name of a [[can]] bus, or "mavlink"')
    esc_index: int | None = Field(None, ge=0, le=31, description="DroneCAN and MAVLink: index of the ESC, from 0")
    rpm_sensor: int | None = Field(None, ge=1, le=2, description="MAVLink: instance in RPM, in place of an ESC")
    node_id: int | None = Field(None, ge=1, le=127, description="DroneCAN: take it from this node only")
    signal: str | None = Field(None, pattern=r"^\w+\.\w+$", description='DBC: "Message.signal"')
    unit: SpeedUnit = Field("rpm", description="DBC: unit of the signal")
    pole_pairs: int | None = Field(
        None, ge=1, le=50, description="DBC: of the motor, where the unit is erpm or pulses"
    )
    signed: bool | None = Field(None, description="False where astern is not told apart; MAVLink: False unless set")
    reverse: bool = Field(False, description="True where a positive speed is astern")
    voltage: str | None = Field(None, pattern=r"^\w+\.\w+$", description='DBC: "Message.signal" in V')
    current: str | None = Field(None, pattern=r"^\w+\.\w+$", description='DBC: "Message.signal" in A')


class Thruster(Section):
    """`[[thruster]]`: one thruster, with where its command and its speed are read."""

    number: int = Field(ge=1, le=99, description="number of the thruster on the vehicle, from 1")
    name: str | None = Field(None, min_length=1, description='in words, e.g. "front left"')
    command: CommandSource = Field(description='e.g. { link = "can0", esc_index = 0 }')
    rpm: RpmSource = Field(description='e.g. { link = "can0", esc_index = 0 }')


class Align(Section):
    """`[align]`: how commands and speeds become evenly spaced samples, see `gateway.align`."""

    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] | None = Field(
        None, description="left out: learnt from RPM and commands"
    )
    gap_s: Positive = Field(0.5, le=10, description="RPM reports further apart are not joined")
    stale_s: Positive = Field(0.5, le=60, description="an older command gives no sample")


class Supervisor(Section):
    """`[supervisor]`: when the pilot is told."""

    suspect_after_s: NotNegative = Field(1.0, description="a suspicion must last this long before it is told")
    fault_after_s: NotNegative = Field(0.0, description="the detector says FAULT only when it is sure: 0 = at once")
    clear_after_s: NotNegative = Field(5.0, description="NORMAL for this long ends a suspicion or a fault")
    repeat_s: float = Field(30.0, ge=10, description="a lasting fault is said again every so often")
    silent_s: Positive = Field(1.5, description="a bus, RPM or command unheard for this long is told")


FailsafeAction = Literal["none", "warn", "hold", "surface", "manual", "disarm"]


class Failsafe(Section):
    """`[failsafe]`: what the autopilot is asked to do, only while it is armed."""

    thruster_fault: FailsafeAction = Field("warn", description="at the onset of a FAULT of a thruster")
    interval_s: float = Field(60.0, ge=10, description="never asked again sooner than this")


class Files(Section):
    """`[files]`"""

    findings: PathText = Field(Path("findings.jsonl"), description="findings, one JSON object a line")
    state: PathText = Field(Path("thrusters.state"), description="what was learnt, for the next start")
    save_every_s: float = Field(60.0, ge=1, description="time between two savings of the state")


@dataclass(frozen=True, slots=True)
class Config:
    """A valid configuration.

    Attributes:
        vehicle: the vehicle's name.
        can: CAN buses.
        mavlink: the link to the autopilot, None = none.
        thruster: thrusters, in the order of the file.
        detector: settings of every thruster's detector.
        align, supervisor, failsafe: as in the file, with defaults filled in.
        files: with absolute paths.
    """

    vehicle: Vehicle
    can: tuple[CanBus, ...]
    mavlink: Mavlink | None
    thruster: tuple[Thruster, ...]
    detector: ThrusterConfig
    align: Align
    supervisor: Supervisor
    failsafe: Failsafe
    files: Files

    def bus(self, name: str) -> CanBus | None:
        """The CAN bus of that name."""
        return next((bus for bus in self.can if bus.name == name), None)

    def links(self) -> list[str]:
        """Names of all links."""
        return [bus.name for bus in self.can] + ([MAVLINK] if self.mavlink else [])


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
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(source, [Problem(source, None, f"not valid TOML: {error}")]) from error
    return _Parser(tables, folder).config(source)


class _Parser:
    """Goes through all tables, however many problems there are, so that none hides another."""

    def __init__(self, tables: dict[str, Any], folder: Path) -> None:
        self._tables = tables
        self._folder = folder
        self._problems: list[Problem] = []

    def config(self, source: str) -> Config:
        known = [field.name for field in fields(Config)]
        self._problems += [unknown_key(key, value, known) for key, value in self._tables.items() if key not in known]
        parts = {
            "vehicle": self._section(Vehicle, "vehicle", required=True),
            "can": tuple(self._each(CanBus, "can", "name")),
            "mavlink": self._section(Mavlink, "mavlink") if "mavlink" in self._tables else None,
            "thruster": tuple(self._each(Thruster, "thruster", "number")),
            "detector": self._detector(),
            "align": self._section(Align, "align"),
            "supervisor": self._section(Supervisor, "supervisor"),
            "failsafe": self._section(Failsafe, "failsafe"),
            "files": self._section(Files, "files"),
        }
        return self._checked(parts, source)

    def _checked(self, parts: dict[str, Any], source: str) -> Config:
        from gateway.consistency import inconsistencies  # it reads the models above

        if parts["files"] is not None:
            parts["files"] = self._absolute(parts["files"], "findings", "state")
        parts["can"] = tuple(self._absolute(bus, "database") for bus in parts["can"])
        crossed = {key: parts[key] for key in ("can", "mavlink", "thruster", "failsafe")}
        self._problems += inconsistencies(self._tables, **crossed)
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
        paths = [f"{key}[{identity}={t[identity]}]" if identity in t else f"{key}[{n}]" for n, t in enumerate(tables)]
        sections = [self._validated(model, table, path) for path, table in zip(paths, tables, strict=True)]
        return [section for section in sections if section is not None]

    def _validated(self, model: type[SectionT], table: object, path: str) -> SectionT | None:
        try:
            return model.model_validate(table)
        except ValidationError as error:
            self._problems += from_validation(error, model, path)
            return None

    def _detector(self) -> ThrusterConfig | None:
        detectors = self._tables.get("detector", {})
        if not isinstance(detectors, dict):
            self._problems.append(Problem("detector", detectors, "should be a table, [detector.thruster]"))
            return None
        unknown = {key: value for key, value in detectors.items() if key != "thruster"}
        self._problems += [unknown_key(f"detector.{key}", value, ["thruster"]) for key, value in unknown.items()]
        config, problems = thruster_settings(detectors.get("thruster", {}), "detector.thruster")
        self._problems += problems
        return config
