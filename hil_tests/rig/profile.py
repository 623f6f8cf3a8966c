"""A vehicle's profile: what it is made of, how its parts speak, and what its gateway should be told."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import tomli_w
from pydantic import Field, ValidationInfo, field_validator

from hil_tests.rig.dronecan_nodes import FIRST_ESC_NODE
from hil_tests.rig.helm import BLUEROV2, Steering
from hil_tests.rig.layout import Layout
from hil_tests.rig.profile_sections import BUS, Bus, Section, Sensors, Thruster
from hil_tests.rig.thruster import T200, ThrusterParameters
from hil_tests.rig.tilt import LIGHT, TiltParameters
from hil_tests.rig.vehicle import BatteryParameters, Build, HullParameters

KNOWN_TYPES = {"t200": T200}
FEWEST_STEPS = 2  # from report to report: ESCs take turns


class Profile(Section):
    """A whole file.

    Attributes:
        name: of the vehicle, in words.
        about: what it is, and where its numbers are from.
        autopilot: whose modes and messages it has.
        step_s: of the simulation; times between commands and reports are whole numbers of it.
        bus: between autopilot and ESCs.
        thruster_types: by names of their own; "t200" is there already.
        thrusters: in the order of their numbers.
        hull, tilt, battery: see `hil_tests.rig`.
        helm: how it is steered.
        sensors: which there are.
        gateway: tables of the gateway's configuration that go with this vehicle: [speed], [detector.speed]...
        folder: that the file lies in.
    """

    name: str = Field(min_length=1)
    about: str = ""
    autopilot: Literal["ardusub", "px4"] = "ardusub"
    step_s: float = Field(default=0.01, ge=0.005, le=0.05)
    bus: Bus = Bus()
    thruster_types: dict[str, ThrusterParameters] = Field(default_factory=dict)
    thrusters: tuple[Thruster, ...] = Field(min_length=1, max_length=20)
    hull: HullParameters = HullParameters()
    tilt: TiltParameters = LIGHT
    battery: BatteryParameters = BatteryParameters()
    helm: Steering = BLUEROV2
    sensors: Sensors = Sensors()
    gateway: dict[str, Any] = Field(default_factory=dict)
    folder: Path = Field(default=Path(), exclude=True)

    @field_validator("bus")
    @classmethod
    def _in_steps(cls, bus: Bus, info: ValidationInfo) -> Bus:
        step_s = info.data.get("step_s", 0.01)
        for name in ("command_hz", "report_hz"):
            steps = 1.0 / (getattr(bus, name) * step_s)
            if abs(steps - round(steps)) > 1e-6 or round(steps) < FEWEST_STEPS:
                most_hz = 1.0 / (FEWEST_STEPS * step_s)
                raise ValueError(f"{name} = {getattr(bus, name):g}: want {most_hz:g} divided by 1, 1.5, 2, 2.5, 3...")
        if (bus.database is None) == (bus.protocol == "dbc"):
            raise ValueError('want a database with protocol "dbc", and only with it')
        return bus

    @field_validator("thrusters")
    @classmethod
    def _known(cls, thrusters: tuple[Thruster, ...], info: ValidationInfo) -> tuple[Thruster, ...]:
        types = [*KNOWN_TYPES, *info.data.get("thruster_types", ())]
        by_signals = info.data.get("bus", Bus()).protocol == "dbc"
        for number, one in enumerate(thrusters, start=1):
            if one.type not in types:
                raise ValueError(f"thruster {number}: type = {one.type!r}: want one of {', '.join(types)}")
            if by_signals and (one.command is None or one.speed is None):
                raise ValueError(f'thruster {number}: want signals for command and speed with protocol "dbc"')
            if not by_signals and (one.command or one.speed):
                raise ValueError(f'thruster {number}: has signals: want protocol "dbc" of the bus')
        return thrusters

    @property
    def database(self) -> Path | None:
        """Of the bus, wherever this process runs."""
        return self.bus.database and (self.folder / self.bus.database).resolve()

    def build(self) -> Build:
        """For the rig."""
        types = KNOWN_TYPES | self.thruster_types
        return Build(
            layout=Layout(tuple(thruster.mount for thruster in self.thrusters)),
            thrusters=tuple(types[thruster.type] for thruster in self.thrusters),
            hull=self.hull,
            tilt=self.tilt,
            battery=self.battery,
        )

    def steps(self, rate_hz: float) -> int:
        """Steps of the simulation from one to the next of something that happens so often."""
        return round(1.0 / (rate_hz * self.step_s))

    def esc_index(self, place: int) -> int:
        """DroneCAN index of the ESC at a place from 0."""
        index = self.thrusters[place].esc_index
        return place if index is None else index

    def node_id(self, place: int) -> int:
        """DroneCAN node of the ESC at a place from 0."""
        node = self.thrusters[place].node
        return FIRST_ESC_NODE + place if node is None else node

    def gateway_toml(
        self,
        folder: Path | None = None,
        *,
        interface: str = "socketcan",
        channel: str = BUS,
        endpoint: str = "udpin:127.0.0.1:14660",
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> str:
        """The gateway's configuration that goes with this vehicle, as the text of its file.

        Args:
            folder: that the file is to lie in; None: the profile's own.
            interface, channel: of the CAN bus, as python-can calls them.
            endpoint: of the MAVLink link.
            settings: tables of the gateway's own, laid over it.
        """
        bus: dict[str, Any] = {"name": BUS, "interface": interface, "channel": channel, "protocol": self.bus.protocol}
        bus["bitrate"] = self.bus.bitrate  # a virtual bus has none of its own, by which its load would be known
        if self.database is not None:
            bus["database"] = os.path.relpath(self.database, (folder or self.folder).resolve())
        tables = {"vehicle": {"name": self.name}, "can": [bus], "mavlink": {"endpoint": endpoint}}
        tables |= self.sensors.tables() | {"thruster": self._thruster_tables()}
        return tomli_w.dumps(laid_over(laid_over(tables, self.gateway), settings))

    def _thruster_tables(self) -> list[dict[str, Any]]:
        by_index = self.bus.protocol == "dronecan"
        return [
            one.table(place + 1, {"esc_index": self.esc_index(place)} if by_index else {})
            for place, one in enumerate(self.thrusters)
        ]


def laid_over(tables: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings over tables, table by table and key by key; what is no table replaces what was there."""
    merged = dict(tables)
    for key, value in settings.items():
        below = merged.get(key)
        both = isinstance(below, Mapping) and isinstance(value, Mapping)
        merged[key] = laid_over(below or {}, value) if both else value
    return merged
