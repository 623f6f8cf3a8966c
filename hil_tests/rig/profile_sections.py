"""The parts of a vehicle's profile: its bus, its thrusters and its sensors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from hil_tests.rig.acoustic import AcousticErrors
from hil_tests.rig.dronecan_nodes import AUTOPILOT_NODE
from hil_tests.rig.dvl import DvlErrors
from hil_tests.rig.geodesy import ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG
from hil_tests.rig.inertial import ImuErrors
from hil_tests.rig.layout import Mount
from hil_tests.rig.navigation import NavigationErrors
from hil_tests.rig.pressure import PressureErrors

BUS = "can0"  # what the gateway calls it
SIGNAL = r"^[^.]+\.[^.]+$"

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Part = Annotated[float, Field(ge=-1.0, le=1.0)]
Signal = Annotated[str, Field(pattern=SIGNAL)]


class Section(BaseModel):
    """A part of a profile: no keys but its own, no changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Bus(Section):
    """The CAN bus between autopilot and ESCs.

    Attributes:
        protocol: what its frames mean.
        bitrate: in bit/s.
        command_hz, report_hz: how often the autopilot commands all ESCs, and how often each of them reports.
        autopilot_node: its DroneCAN node id.
        database: of protocol "dbc", relative to the profile's file.
        checksum: of protocol "dbc": what stands in the signals `Checksum`, over all other bytes of the message.
    """

    protocol: Literal["dronecan", "dbc"] = "dronecan"
    bitrate: int = Field(default=1_000_000, ge=10_000, le=1_000_000)
    command_hz: Positive = 20.0
    report_hz: Positive = 20.0
    autopilot_node: int = Field(default=AUTOPILOT_NODE, ge=1, le=127)
    database: Path | None = None
    checksum: Literal["crc8_sae_j1850", "sum8", "xor8"] = "crc8_sae_j1850"


class Thruster(Section):
    """One thruster, in the order of their numbers from 1.

    Attributes:
        name: in words.
        type: one of the profile's `thruster_types`.
        ahead, right, down: the part of its thrust that goes there when its command is positive.
        yaw_arm_m: lever arm of its thrust about the vertical axis; positive turns clockwise, seen from above.
        reversible: False: it only turns ahead, and its commands begin at 0.
        reverse: commands and speeds on the bus have the other sign.
        esc_index, node: of a DroneCAN ESC; left out: they count on from 0, and from 11.
        command, speed: signals of a DBC database, "Message.signal".
        voltage, current: the same, where they are told.
        full_scale: value of `command` that is full ahead; full astern is its negative.
    """

    name: str = Field(min_length=1)
    type: str = "t200"
    ahead: Part = 0.0
    right: Part = 0.0
    down: Part = 0.0
    yaw_arm_m: float = 0.0
    reversible: bool = True
    reverse: bool = False
    esc_index: int | None = Field(default=None, ge=0, le=19)
    node: int | None = Field(default=None, ge=1, le=127)
    command: Signal | None = None
    speed: Signal | None = None
    voltage: Signal | None = None
    current: Signal | None = None
    full_scale: Positive = 1.0

    @property
    def mount(self) -> Mount:
        """How it is built in."""
        return Mount(
            ahead=self.ahead,
            right=self.right,
            down=self.down,
            yaw_arm_m=self.yaw_arm_m,
            reversible=self.reversible,
        )

    def table(self, number: int, source: dict[str, Any]) -> dict[str, Any]:
        """Its [[thruster]] in the gateway's configuration.

        Args:
            number: its own.
            source: what command and speed have in common on the bus.
        """
        shared = {"link": BUS} | source | ({"reverse": True} if self.reverse else {})
        directions = {name: getattr(self, name) for name in ("ahead", "right", "down") if getattr(self, name)}
        sources = {"command": shared | self._command(), "rpm": shared | self._rpm()}
        return {"number": number, "name": self.name} | directions | sources

    def _command(self) -> dict[str, Any]:
        if self.command is None:
            return {} if self.reversible else {"bidirectional": False}
        least = -self.full_scale if self.reversible else 0.0
        return {"signal": self.command, "minimum": least, "neutral": 0.0, "maximum": self.full_scale}

    def _rpm(self) -> dict[str, Any]:
        told = {"signal": self.speed, "voltage": self.voltage, "current": self.current}
        return {key: signal for key, signal in told.items() if signal is not None}


class Sensors(Section):
    """Which there are, and how far off they are; left out: there is none, but for an autopilot's estimates.

    Attributes:
        navigation: how wrong the autopilot is about its position and attitude.
        imu, dvl, pressure: see `hil_tests.rig`; {} is one with the usual errors.
        acoustic: a USBL or the like.
    """

    navigation: NavigationErrors = NavigationErrors()
    imu: ImuErrors | None = None
    dvl: DvlErrors | None = None
    pressure: PressureErrors | None = None
    acoustic: AcousticErrors | None = None

    def tables(self) -> dict[str, Any]:
        """[navigation] of the gateway's configuration, where there is a DVL: where it is, roughly, and how the DVL is
        built in; the rest is found out."""
        if self.dvl is None:
            return {}
        return {
            "navigation": {
                "latitude_deg": ORIGIN_LATITUDE_DEG,
                "longitude_deg": ORIGIN_LONGITUDE_DEG,
                "dvl_lever_arm_m": list(self.dvl.lever_arm_m),
                "dvl_delay_s": self.dvl.delay_s,
            }
        }
