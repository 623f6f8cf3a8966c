"""What a sensor said, at one instant: frozen values with their units in their names.

A reading that exists is valid: NaN and infinity stop at the driver, as None (not measured) or as a counted drop.
`time_s` is stamped once, at reception, and is the only time that anything behind the driver sees. Angles are radians,
the earth frame is north-east-down, the body frame forward-right-down.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from drivers.bus_readings import BusReading


@dataclass(frozen=True, slots=True)
class ThrusterCommand:
    """A command on its way to a thruster.

    Attributes:
        time_s: reception.
        thruster: number of the thruster in the configuration, from 1.
        fraction: -1.0 (full reverse) to 1.0 (full ahead), 0.0 neutral, dead band and direction already applied.
    """

    time_s: float
    thruster: int
    fraction: float


@dataclass(frozen=True, slots=True)
class ThrusterReport:
    """What an ESC or a Hall sensor said of one thruster. None: not in this message, or not known to the sender.

    Attributes:
        time_s: reception.
        thruster: number of the thruster in the configuration, from 1.
        speed_rpm: propeller speed; signed where the sensor has a sign, else the magnitude.
        voltage_v: supply voltage.
        current_a: supply or motor current.
        temperature_k: ESC temperature.
        error_count: the ESC's own count; it falls back when the motor restarts.
    """

    time_s: float
    thruster: int
    speed_rpm: float | None = None
    voltage_v: float | None = None
    current_a: float | None = None
    temperature_k: float | None = None
    error_count: int | None = None


@dataclass(frozen=True, slots=True)
class AutopilotHeartbeat:
    """HEARTBEAT of an autopilot: MAV_AUTOPILOT, MAV_TYPE, MAV_STATE and the autopilot's own mode number."""

    time_s: float
    system_id: int
    component_id: int
    autopilot: int
    vehicle_type: int
    armed: bool
    custom_mode: int
    system_status: int


@dataclass(frozen=True, slots=True)
class AutopilotReboot:
    """The autopilot's own time since boot went back: it restarted, and forgot what it was asked to stream."""

    time_s: float
    system_id: int


@dataclass(frozen=True, slots=True)
class AutopilotConflict:
    """More than one autopilot on one link, and nobody said which is ours; or that there is one again.

    Attributes:
        time_s: reception of the HEARTBEAT that showed it.
        system_ids: MAVLink system ids of the autopilots heard, ascending; a single one: the conflict is over.
    """

    time_s: float
    system_ids: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class IdentityConflict:
    """Another program on the network sends with our own ids; said again every 10 s while it does.

    Attributes:
        time_s: reception of the packet that left no doubt.
        system_id, component_id: ours, and that program's.
    """

    time_s: float
    system_id: int
    component_id: int


@dataclass(frozen=True, slots=True)
class AutopilotClock:
    """Our clock against the autopilot's, as TIMESYNC measured it of late.

    Attributes:
        time_s: reception of the answer.
        boot_s: the autopilot's clock when it answered.
        system_id: the autopilot's.
        offset_s: to be added to its time since boot.
        round_trip_s: of the quickest exchange of late, which `offset_s` is from; it is wrong by half of that at most.
    """

    time_s: float
    boot_s: float
    system_id: int
    offset_s: float
    round_trip_s: float


@dataclass(frozen=True, slots=True)
class CommandAcknowledgement:
    """COMMAND_ACK: MAV_CMD, MAV_RESULT, and progress in percent while in progress (255 = not said)."""

    time_s: float
    system_id: int
    component_id: int
    command: int
    result: int
    progress: int


class OperatorAct(IntEnum):
    """What an operator says of a subject: the MAV_CMD that it comes as."""

    ACKNOWLEDGE = 31010  # MAV_CMD_USER_1: seen; it need not be repeated, and nothing is to be done about it
    ACCEPT = 31011  # MAV_CMD_USER_2: well as it is; how it is now is the new normal
    MUTE = 31012  # MAV_CMD_USER_3: no texts of it for a while


@dataclass(frozen=True, slots=True)
class OperatorRequest:
    """An operator's word on a subject, over MAVLink or from this machine.

    Attributes:
        time_s: reception.
        act: what he says.
        code: of which subject, see `gateway.operator`; 0 = of all.
        duration_s: for how long (mute); 0 = as long as is usual.
        system_id, component_id: who says so, and gets the answer; 0, 0 = this machine's operator.
    """

    time_s: float
    act: OperatorAct
    code: int
    duration_s: float
    system_id: int
    component_id: int


@dataclass(frozen=True, slots=True)
class Attitude:
    """Attitude of the vehicle and its body rates; `boot_s` as in `Inertial`."""

    time_s: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    roll_rate_radps: float
    pitch_rate_radps: float
    yaw_rate_radps: float
    boot_s: float | None = None


@dataclass(frozen=True, slots=True)
class GlobalPosition:
    """Position on the earth; depth positive downwards below mean sea level; velocity north, east, down."""

    time_s: float
    latitude_rad: float
    longitude_rad: float
    depth_m: float
    velocity_mps: tuple[float, float, float]
    boot_s: float | None = None


@dataclass(frozen=True, slots=True)
class LocalPosition:
    """Position and velocity north, east, down of the autopilot's own origin."""

    time_s: float
    position_m: tuple[float, float, float]
    velocity_mps: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class PositionFix:
    """Position on the earth as a positioning system measured it: GPS, or an acoustic system such as USBL.

    Attributes:
        time_s: reception; an acoustic fix is older by up to a second or two, and nobody says by how much.
        latitude_rad, longitude_rad: WGS 84.
        depth_m: below mean sea level; None: not in this fix.
        accuracy_m: horizontal, as the sender sees it (standard deviation, roughly); None: not said.
        source: who measured: fixes of two sources differ by their offsets, and do not make one track.
    """

    time_s: float
    latitude_rad: float
    longitude_rad: float
    depth_m: float | None
    accuracy_m: float | None
    source: str


@dataclass(frozen=True, slots=True)
class Inertial:
    """What an inertial measurement unit felt.

    Attributes:
        time_s: reception, later than the measurement by what the link's queues took, which differs from one to the
            next.
        boot_s: the same instant on the sender's own clock, which begins at its start; None: it has none. For what is
            integrated over time this is the one that counts.
        source: which unit, by the message that it came in.
        specific_force_mps2: (3,) forward, right, down; at rest and level (0, 0, -9.8).
        angular_rate_radps: (3,) about the same axes.
    """

    time_s: float
    boot_s: float | None
    source: str
    specific_force_mps2: tuple[float, float, float]
    angular_rate_radps: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class BodyVelocity:
    """Velocity over ground as a Doppler velocity log, or what stands in for one, measured it.

    Attributes:
        time_s: reception.
        boot_s: on the sender's own clock; None: it has none, as DVL drivers mostly do.
        velocity_mps: (3,) forward, right, down.
        source: message and sender.
    """

    time_s: float
    boot_s: float | None
    velocity_mps: tuple[float, float, float]
    source: str


@dataclass(frozen=True, slots=True)
class WaterPressure:
    """Absolute pressure at one of the autopilot's barometers. Of the first one it may well be that of the hull's air.

    Attributes:
        time_s: reception.
        boot_s: on the autopilot's own clock.
        instance: 1, 2 or 3.
        pressure_pa: absolute.
        temperature_k: of the sensor; None: not said.
    """

    time_s: float
    boot_s: float
    instance: int
    pressure_pa: float
    temperature_k: float | None


@dataclass(frozen=True, slots=True)
class LinkState:
    """A bus or link came up, went down, or told of trouble while it stayed up.

    Attributes:
        time_s: when it was noticed.
        link: the link's name in the configuration.
        up: True while frames can come and go.
        detail: why, in a few words; empty when all is well.
    """

    time_s: float
    link: str
    up: bool
    detail: str


@dataclass(frozen=True, slots=True)
class BusLoad:
    """How much of its time a CAN bus carries frames.

    Attributes:
        time_s: end of the interval that it was measured over.
        link: the bus's name in the configuration.
        share: of the bit rate, 0.0 to 1.0 and a little above: bit stuffing is estimated.
    """

    time_s: float
    link: str
    share: float


@dataclass(frozen=True, slots=True)
class FrameLoss:
    """Frames of a CAN bus that were lost on their way to this program: said each second from the first loss on.

    Attributes:
        time_s: end of the second.
        link: the bus's name in the configuration.
        frames: found no room in the socket's buffer, because this program was too slow.
        overruns: how often the controller's own buffer ran over: the driver was too slow, by how many nobody says.
    """

    time_s: float
    link: str
    frames: int
    overruns: int


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late this program is with its own work.

    Attributes:
        time_s: of the newest reading that is judged by now.
        behind_s: how long readings wait until they are judged, all of them since this was last said.
        lost: readings that found no room any more, since this was last said.
    """

    time_s: float
    behind_s: float
    lost: int


@dataclass(frozen=True, slots=True)
class OwnClock:
    """It is so late, and nothing else is told: silence shows by that. Of a recording; live, the pipeline is told."""

    time_s: float


Reading = (
    ThrusterCommand
    | ThrusterReport
    | AutopilotHeartbeat
    | AutopilotReboot
    | AutopilotConflict
    | IdentityConflict
    | AutopilotClock
    | CommandAcknowledgement
    | OperatorRequest
    | Attitude
    | GlobalPosition
    | LocalPosition
    | PositionFix
    | Inertial
    | BodyVelocity
    | WaterPressure
    | LinkState
    | BusLoad
    | FrameLoss
    | Lateness
    | OwnClock
    | BusReading
)
