"""A vehicle's profile: what it is made of, how its parts speak, and what its gateway should be told."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field

from hil_tests.rig.acoustic import AcousticErrors
from hil_tests.rig.dronecan_nodes import AUTOPILOT_NODE, FIRST_ESC_NODE
from hil_tests.rig.dvl import DvlErrors
from hil_tests.rig.geodesy import ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG
from hil_tests.rig.inertial import ImuErrors
from hil_tests.rig.layout import Layout, Mount
from hil_tests.rig.navigation import NavigationErrors
from hil_tests.rig.pressure import PressureErrors
from hil_tests.rig.thruster import T200, ThrusterParameters
from hil_tests.rig.tilt import LIGHT, TiltParameters
from hil_tests.rig.vehicle import BatteryParameters, Build, HullParameters

BUS = "can0"  # what the gateway calls it

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class Section(BaseModel):
    """A part of a profile: no keys but its own, no changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Bus(Section):
    """The CAN bus between autopilot and ESCs.

    Attributes:
        protocol: what its frames mean.
        bitrate: in bit/s.
        command_hz, report_hz: how often the autopilot commands all ESCs, and how often each of them reports.
        database: of protocol "dbc", relative to the profile's file.
        autopilot_node: its DroneCAN node id.
    """

    protocol: Literal["dronecan", "dbc"] = "dronecan"
    bitrate: int = Field(default=1_000_000, ge=10_000, le=1_000_000)
    command_hz: Positive = 20.0
    report_hz: Positive = 20.0
    database: Path | None = None
    autopilot_node: int = Field(default=AUTOPILOT_NODE, ge=1, le=127)


class Thruster(Section):
    """One thruster, in the order of their numbers from 1.

    Attributes:
        name: in words.
        type: one of the profile's `thruster_types`.
        ahead, right, down: the part of its thrust that goes there when its command is positive.
        yaw_arm_m: lever arm of its thrust about the vertical axis; positive turns clockwise, seen from above.
        reverse: commands and speeds on the bus have the other sign.
        esc_index, node: of a DroneCAN ESC.
        command, speed: signals of a DBC database, "Message.signal"; their messages may have a counter and a checksum.
        voltage, current: the same, where they are told.
        full_scale: value of `command` that is full ahead; full astern is its negative.
    """

    name: str
    type: str = "t200"
    ahead: float = Field(default=0.0, ge=-1.0, le=1.0)
    right: float = Field(default=0.0, ge=-1.0, le=1.0)
    down: float = Field(default=0.0, ge=-1.0, le=1.0)
    yaw_arm_m: float = 0.0
    reverse: bool = False
    esc_index: int | None = Field(default=None, ge=0, le=19)
    node: int | None = Field(default=None, ge=1, le=127)
    command: str | None = None
    speed: str | None = None
    voltage: str | None = None
    current: str | None = None
    full_scale: Positive = 1.0

    @property
    def mount(self) -> Mount:
        """How it is built in."""
        return Mount(ahead=self.ahead, right=self.right, down=self.down, yaw_arm_m=self.yaw_arm_m)


class Sensors(Section):
    """Which there are, and how far off they are; None: there is none.

    Attributes:
        navigation: how wrong the autopilot is about its position and attitude.
    """

    navigation: NavigationErrors = NavigationErrors()
    imu: ImuErrors | None = None
    dvl: DvlErrors | None = None
    pressure: PressureErrors | None = None
    acoustic: AcousticErrors | None = None


class Profile(Section):
    """A whole file.

    Attributes:
        name: of the vehicle, in words.
        about: what it is, and where its numbers are from.
        autopilot: whose modes and messages it has.
        step_s: of the simulation; times between commands and reports are whole numbers of it.
        agility: how much less yaw stick a turn takes than on a BlueROV2 Heavy.
        bus: between autopilot and ESCs.
        thruster_types: by names of their own; "t200" is there already.
        thrusters: in the order of their numbers.
        hull, tilt, battery: see `hil_tests.rig`.
        sensors: which there are.
        gateway: tables of the gateway's configuration that go with this vehicle: [speed], [detector.speed]...
        folder: that the file lies in.
    """

    name: str = Field(min_length=1)
    about: str = ""
    autopilot: Literal["ardusub", "px4"] = "ardusub"
    step_s: float = Field(default=0.01, ge=0.005, le=0.05)
    agility: Positive = 1.0
    bus: Bus = Bus()
    thruster_types: dict[str, ThrusterParameters] = Field(default_factory=dict)
    thrusters: tuple[Thruster, ...] = Field(min_length=1)
    hull: HullParameters = HullParameters()
    tilt: TiltParameters = LIGHT
    battery: BatteryParameters = BatteryParameters()
    sensors: Sensors = Sensors()
    gateway: dict[str, Any] = Field(default_factory=dict)
    folder: Path = Path()

    def build(self) -> Build:
        """For the rig."""
        types = {"t200": T200} | self.thruster_types
        return Build(
            layout=Layout(tuple(thruster.mount for thruster in self.thrusters)),
            thrusters=tuple(types[thruster.type] for thruster in self.thrusters),
            hull=self.hull,
            tilt=self.tilt,
            battery=self.battery,
        )

    @property
    def database(self) -> Path | None:
        """Of the bus, wherever this process runs."""
        return self.bus.database and (self.folder / self.bus.database).resolve()

    def steps(self, rate_hz: float) -> int:
        """Steps of the simulation from one to the next of something that happens so often."""
        return round(1.0 / (rate_hz * self.step_s))

    def esc_index(self, place: int) -> int:
        """DroneCAN index of the ESC at a place from 0; the place itself where the profile says nothing."""
        index = self.thrusters[place].esc_index
        return place if index is None else index

    def node_id(self, place: int) -> int:
        """DroneCAN node of the ESC at a place from 0; those that have none of their own count on from 11."""
        node = self.thrusters[place].node
        return FIRST_ESC_NODE + place if node is None else node

    def gateway_toml(
        self,
        folder: Path,
        *,
        interface: str,
        channel: str,
        endpoint: str,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> str:
        """The gateway's configuration that goes with this vehicle, as the text of its file.

        Args:
            folder: that the file is to lie in.
            interface, channel: of the CAN bus, as python-can calls them.
            endpoint: of the MAVLink link.
            settings: tables of the gateway's own, laid over it.
        """
        return tomli_w.dumps(laid_over(self._tables(folder, interface, channel, endpoint), settings))

    def _tables(self, folder: Path, interface: str, channel: str, endpoint: str) -> dict[str, Any]:
        bus: dict[str, Any] = {"name": BUS, "interface": interface, "channel": channel, "protocol": self.bus.protocol}
        if self.database is not None:
            bus["database"] = os.path.relpath(self.database, folder.resolve())
        tables: dict[str, Any] = {"vehicle": {"name": self.name}, "can": [bus], "mavlink": {"endpoint": endpoint}}
        tables["thruster"] = [self._thruster_table(place) for place in range(len(self.thrusters))]
        if self.sensors.dvl is not None:
            tables["navigation"] = self._navigation_table(self.sensors.dvl)
        files = {"findings": "findings.jsonl", "state": "vehicle.state", "control": "gateway.sock"}
        return laid_over(tables | {"files": files}, self.gateway)

    def _thruster_table(self, place: int) -> dict[str, Any]:
        one = self.thrusters[place]
        called = {"number": place + 1, "name": one.name}
        directions = {name: getattr(one, name) for name in ("ahead", "right", "down") if getattr(one, name)}
        shared = {"link": BUS} | ({"reverse": True} if one.reverse else {})
        if self.bus.protocol == "dronecan":
            index = {"esc_index": self.esc_index(place)}
            return {
                "number": place + 1,
                "name": one.name,
                "command": shared | index,
                "rpm": shared | index,
            } | directions
        scale = {"minimum": -one.full_scale, "neutral": 0.0, "maximum": one.full_scale}
        told = {"voltage": one.voltage, "current": one.current}
        command = shared | {"signal": one.command} | scale
        rpm = shared | {"signal": one.speed} | {name: signal for name, signal in told.items() if signal}
        return called | {"command": command, "rpm": rpm} | directions

    def _navigation_table(self, log: DvlErrors) -> dict[str, Any]:
        """Where it is, roughly, and how the DVL is built in; the rest is found out."""
        return {
            "latitude_deg": ORIGIN_LATITUDE_DEG,
            "longitude_deg": ORIGIN_LONGITUDE_DEG,
            "dvl_lever_arm_m": list(log.lever_arm_m),
            "dvl_delay_s": log.delay_s,
        }


def laid_over(tables: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings over tables, table by table and key by key; what is no table replaces what was there."""
    merged = dict(tables)
    for key, value in settings.items():
        below = merged.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            value = laid_over(below, value)
        merged[key] = value
    return merged
