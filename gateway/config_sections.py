"""The tables of the configuration file: which keys each has, what they mean, what is left out has which default.

What they contradict each other in is in `gateway.consistency`; reading the file is in `gateway.config`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, Strict

from drivers.can.dbc import SpeedUnit

# name of the link to the autopilot, where buses have names of their own
MAVLINK = "mavlink"

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
PathText = Annotated[Path, Strict(False)]


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
