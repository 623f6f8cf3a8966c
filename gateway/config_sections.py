"""The tables of the configuration file: which keys each has, what they mean, what is left out has which default.

What they contradict each other in is in `gateway.consistency`; reading the file is in `gateway.config`.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal
from unicodedata import category

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, Strict

from drivers.can.dbc import SpeedUnit
from drivers.can.vesc import Control
from gateway.local_frame import LocalFrame
from gateway.supervision.actions import Action

# name of the link to the autopilot, where buses have names of their own
MAVLINK = "mavlink"
# a message and a signal of a database; SYM files have names of several words
SIGNAL = r"^[^.]+\.[^.]+$"
# no vehicle under water is faster: what is was meant in another unit
SPEED_MAX_MPS = 30.0

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=-1, le=1)]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Direction = Annotated[float, Field(ge=0, le=360)]
Longitude = Annotated[float, Field(ge=-180, le=360)]
PathText = Annotated[Path, Strict(False)]
Triple = Annotated[tuple[float, float, float], Strict(False)]
# the navigation filter's model of a mounting is that of a small rotation
SmallAngle = Annotated[float, Field(ge=-20, le=20)]
SmallAngles = Annotated[tuple[SmallAngle, SmallAngle, SmallAngle], Strict(False)]


def _several(value: object) -> object:
    """One number alone is a list of one."""
    return [value] if isinstance(value, int) else value


def _printable(name: str) -> str:
    """Names stand on terminals and in pictures, where control characters do harm."""
    if any(category(letter) == "Cc" for letter in name):
        raise ValueError("want letters that can be printed: there is a control character among them")
    return name


Name = Annotated[str, Field(min_length=1), AfterValidator(_printable)]


class Section(BaseModel):
    """A table of the file. A key that is not listed in it is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Vehicle(Section):
    """`[vehicle]`"""

    name: Name = Field(description='what the logs call the vehicle, e.g. "BlueROV2 Heavy"')


class CanBus(Section):
    """`[[can]]`: one CAN bus."""

    name: str = Field(pattern=r"^[A-Za-z0-9_-]{1,16}$", description='what the thrusters call this bus, e.g. "can0"')
    interface: str = Field(
        "socketcan",
        description='a python-can interface, e.g. "socketcan", "slcan"; "mavlink": a bus that the autopilot forwards',
    )
    channel: str = Field(
        min_length=1,
        description='the channel of that interface, e.g. "can0"; "mavlink": "1" is the autopilot\'s CAN1',
    )
    protocol: Literal["dronecan", "vesc", "dbc"] = Field(
        description='what the frames mean; "dbc": whatever a database says'
    )
    database: PathText | None = Field(None, description='protocol "dbc": the .dbc, .kcd, .sym or .arxml file')
    bitrate: int | None = Field(
        None, gt=0, description="bit/s, for interfaces that set it; SocketCAN's is set by `ip link`"
    )
    listen_only: bool = Field(
        False, description="True: its controller does not even acknowledge frames; SocketCAN's is set by `ip link`"
    )
    load_max: float = Field(
        0.7, gt=0, le=1, description="of the bit rate; percent? 70 % is 0.7. A bus that carries more is told"
    )

    @property
    def forwarded(self) -> bool:
        """Whether it is one of the autopilot's, read over MAVLink."""
        return self.interface == MAVLINK


class Mavlink(Section):
    """`[mavlink]`: the link to the autopilot."""

    endpoint: str = Field(
        description='"udpin:HOST:PORT", "udpout:HOST:PORT", "tcp:HOST:PORT" or "serial:DEVICE:BAUD"'
    )
    component_id: int = Field(
        192, ge=2, le=250, description="our own component, 1 is the autopilot; 192 is MAV_COMP_ID_ONBOARD_COMPUTER2"
    )
    # 255 is the ground station's: a companion that uses it silently disables ArduSub's GCS failsafe
    system_id: int | None = Field(
        None, ge=1, le=254, description="the vehicle's system; left out: the one autopilot seen"
    )
    operators: Annotated[list[Annotated[int, Field(ge=1, le=255)]], BeforeValidator(_several)] = Field(
        [255], description="systems whose commands to us are taken; 255 is the ground station's"
    )
    signing_key: PathText | None = Field(
        None, description="file with the key of MAVLink 2 signing; left out: nothing is signed, nothing checked"
    )
    signing_link_id: int = Field(0, ge=0, le=255, description="link id in our own signatures")
    accept_unsigned: bool = Field(
        False, description="True for an autopilot that does not sign, e.g. on USB: all but commands to us is heard"
    )
    named_values_period_s: NotNegative = Field(
        1.0, le=60, description="scores and residuals for ground stations to plot come this often; 0 = not at all"
    )


class CommandSource(Section):
    """`command = { ... }`: where the command of a thruster is read."""

    link: str = Field(description='name of a [[can]] bus, or "mavlink"')
    esc_index: int | None = Field(None, ge=0, le=19, description="DroneCAN: place in esc.RawCommand, from 0")
    bidirectional: bool = Field(True, description="DroneCAN: False where 0..8191 is idle to full ahead")
    maximum_rpm: Annotated[float, Field(gt=0, le=131_071)] | None = Field(
        None, description="DroneCAN: rpm at full thrust, for esc.RPMCommand; left out: esc.RawCommand is read"
    )
    servo_channel: int | None = Field(None, ge=1, le=32, description="MAVLink: output in SERVO_OUTPUT_RAW, from 1")
    actuator: int | None = Field(
        None, ge=1, le=32, description="MAVLink: output in PX4's ACTUATOR_OUTPUT_STATUS, from 1, in place of a servo"
    )
    controller_id: int | None = Field(None, ge=0, le=254, description='VESC: its "VESC ID" in VESC Tool')
    control: Control | None = Field(None, description="VESC: which commands it gets: SET_DUTY, SET_CURRENT...")
    signal: str | None = Field(None, pattern=SIGNAL, description='DBC: "Message.signal"')
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
    controller_id: int | None = Field(None, ge=0, le=254, description='VESC: its "VESC ID" in VESC Tool')
    signal: str | None = Field(None, pattern=SIGNAL, description='DBC: "Message.signal"')
    unit: SpeedUnit = Field("rpm", description="DBC: unit of the signal")
    pole_pairs: int | None = Field(
        None, ge=1, le=50, description="of the motor: VESC; DBC, where the unit is erpm or pulses"
    )
    signed: bool | None = Field(None, description="False where astern is not told apart; MAVLink: False unless set")
    reverse: bool = Field(False, description="True where a positive speed is astern")
    voltage: str | None = Field(None, pattern=SIGNAL, description='DBC: "Message.signal" in V')
    current: str | None = Field(None, pattern=SIGNAL, description='DBC: "Message.signal" in A')


class Thruster(Section):
    """`[[thruster]]`: one thruster, with where its command and its speed are read."""

    number: int = Field(ge=1, le=99, description="number of the thruster on the vehicle, from 1")
    name: Name | None = Field(None, description='in words, e.g. "front left"')
    command: CommandSource = Field(description='e.g. { link = "can0", esc_index = 0 }')
    rpm: RpmSource = Field(description='e.g. { link = "can0", esc_index = 0 }')
    ahead: Share = Field(
        0.0, description="part of its thrust that drives the vehicle ahead when its command is positive"
    )
    right: Share = Field(
        0.0, description="part of its thrust that drives it to the right when its command is positive"
    )
    down: Share = Field(0.0, description="part of its thrust that drives it down when its command is positive")


class Align(Section):
    """`[align]`: how commands and speeds become evenly spaced samples, see `gateway.align`."""

    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] | None = Field(
        None, description="left out: learnt from RPM and commands"
    )
    gap_s: Positive = Field(0.5, le=10, description="RPM reports further apart are not joined")
    stale_s: Positive = Field(0.5, le=60, description="an older command gives no sample")


class Constituent(Section):
    """`[[speed.flow.constituents]]`: one constituent of the tide, by its amplitudes or by its ellipse."""

    name: str = Field(min_length=1, description="M2, S2, N2, K1, O1...")
    north_mps: NotNegative | None = Field(None, description="amplitude of the current to the north (v)")
    north_lag_deg: float | None = Field(None, description="its Greenwich phase lag")
    east_mps: NotNegative | None = Field(None, description="amplitude of the current to the east (u)")
    east_lag_deg: float | None = Field(None, description="its Greenwich phase lag")
    semi_major_mps: NotNegative | None = Field(None, description="ellipse: largest speed")
    semi_minor_mps: float | None = Field(
        None, description="ellipse: smallest speed, negative where it turns clockwise"
    )
    inclination_deg: float | None = Field(None, description="ellipse: of the major axis, counter-clockwise from east")
    lag_deg: float | None = Field(None, description="ellipse: Greenwich phase lag of the largest speed")


class Flow(Section):
    """`[speed.flow]`: what is known of the current from elsewhere: a constant one, a tide, or a forecast file."""

    speed_mps: NotNegative | None = Field(None, description="of the constant current")
    direction_deg: Direction | None = Field(None, description="true direction that the constant current sets towards")
    constituents: list[Constituent] = Field([], description="of the tide; a constant current is its mean")
    file: PathText | None = Field(None, description="NetCDF file of a current forecast")
    latitude_deg: Latitude | None = Field(
        None, description="of the dive site: the part of the file around it is read"
    )
    longitude_deg: Longitude | None = Field(None, description="of the dive site")
    eastward: str | None = Field(None, description="the file's variable; left out: found by its standard name")
    northward: str | None = Field(None, description="the file's variable; left out: found by its standard name")

    def site(self) -> LocalFrame | None:
        """The frame of the dive site, where it is given."""
        if self.latitude_deg is None or self.longitude_deg is None:
            return None
        return LocalFrame.at_degrees(self.latitude_deg, self.longitude_deg)


class Speed(Section):
    """`[speed]`: the watch over the vehicle's speed through the water. Without this table there is none."""

    position: Literal["auto", "local", "global", "fix"] = Field(
        "auto",
        description="source of positions; auto: fixes (USBL, GPS), else the autopilot's local, else its global",
    )
    minimum_mps: NotNegative | None = Field(
        None, le=SPEED_MAX_MPS, description="m/s? least normal speed; left out, with maximum_mps: learnt"
    )
    maximum_mps: Positive | None = Field(None, le=SPEED_MAX_MPS, description="m/s? largest normal speed")
    command: Annotated[float, Field(gt=0, le=1)] | None = Field(
        None, description="that minimum_mps and maximum_mps belong to; percent? 60 % is 0.6"
    )
    tolerance: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.2, description="of the learnt normal speed: a share of it up or down is normal"
    )
    curve: list[Annotated[tuple[float, float], Strict(False)]] | None = Field(
        None,
        min_length=1,
        description="normal speed over the command, [[command, m/s], ...] ascending; left out: learnt",
    )
    flow: Flow | None = Field(None, description="what is known of the current from elsewhere")

    def origin(self) -> LocalFrame | None:
        """The frame of the positions, where it is given."""
        return None if self.flow is None else self.flow.site()


ImuName = Literal["auto", "raw_imu", "scaled_imu", "scaled_imu2", "scaled_imu3", "highres_imu"]
DvlName = Literal["auto", "vision_position_delta", "odometry", "vision_speed_estimate", "none"]
DepthName = Literal["auto", "scaled_pressure2", "scaled_pressure3", "scaled_pressure", "global_position", "none"]
FixName = Literal["gps_input", "global_position", "none"]


class Navigation(Section):
    """`[navigation]`: the watch over DVL, depth sensor and inertial unit. Without this table there is none."""

    imu: ImuName = Field("auto", description="message of the inertial unit; auto: PX4's HIGHRES_IMU, else RAW_IMU")
    dvl: DvlName = Field("auto", description="message of the DVL; auto: VISION_POSITION_DELTA, else ODOMETRY")
    depth: DepthName = Field(
        "auto", description="auto: SCALED_PRESSURE2, else SCALED_PRESSURE3, else the autopilot's depth"
    )
    fix: FixName = Field(
        "gps_input", description="positions; the autopilot's global position is made from the same DVL"
    )
    water_density_kgm3: float = Field(
        1025.0, ge=900, le=1300, description="kg/m3? 1025 in the sea, 998 in fresh water"
    )
    surface_pressure_pa: float = Field(101_325.0, ge=50_000, le=110_000, description="Pa? that of the air is 101325")
    latitude_deg: Latitude = Field(45.0, description="where, roughly: for gravity and for the turning of the earth")
    longitude_deg: Longitude = Field(0.0, description="where, roughly")
    dvl_lever_arm_m: Triple = Field(
        (0.0, 0.0, 0.0), description="from the inertial unit to the DVL: [forward, right, down]"
    )
    dvl_mounting_deg: SmallAngles = Field(
        (0.0, 0.0, 0.0),
        description="of the DVL in the vehicle: [roll, pitch, yaw]; beyond it, set the orientation in its own driver",
    )
    dvl_delay_s: float = Field(0.0, ge=-2, le=2, description="by which the DVL's samples come later")
    lstm_model: PathText | None = Field(None, description="of gateway train; left out: the one that comes along")


class Clear(StrEnum):
    """What ends a fault beside the operator's word."""

    RECOVERED = "recovered"
    DISARMED = "disarmed"


ClearedBy = Annotated[tuple[Annotated[Clear, Strict(False)], ...], Strict(False)]


class Times(Section):
    """`[supervisor.thruster]`, `[supervisor.speed]`, `[supervisor.navigation]`: other times than for the rest."""

    suspect_after_s: NotNegative | None = Field(None, description="a suspicion must last this long")
    fault_after_s: NotNegative | None = Field(None, description="a FAULT must last this long")
    clear_after_s: NotNegative | None = Field(None, description="NORMAL must last this long")


class Supervisor(Section):
    """`[supervisor]`: when the pilot is told."""

    suspect_after_s: NotNegative = Field(1.0, description="a suspicion must last this long before it is told")
    fault_after_s: NotNegative = Field(0.0, description="the detector says FAULT only when it is sure: 0 = at once")
    clear_after_s: NotNegative = Field(5.0, description="NORMAL for this long ends a suspicion or a fault")
    cleared_by: ClearedBy = Field(
        (Clear.RECOVERED, Clear.DISARMED),
        description="what ends a fault; [] = only the operator",
    )
    repeat_s: float = Field(30.0, ge=10, description="a lasting fault is said again every so often")
    suspect_repeat_s: float = Field(300.0, ge=10, description="a lasting suspicion is said again every so often")
    texts_per_minute: float = Field(30.0, ge=2, le=600, description="of all texts; what is more than that waits")
    silent_s: Positive = Field(1.5, description="a bus, RPM, command or heading unheard for this long is told")
    thruster: Times | None = Field(None, description="other times for thrusters")
    speed: Times | None = Field(None, description="other times for the speed through the water")
    navigation: Times | None = Field(None, description="other times for navigation sensors")


def _listed(value: object) -> object:
    """One action alone is a list of one."""
    listed = (value,) if isinstance(value, str) else value
    if not (isinstance(listed, list | tuple) and listed and all(isinstance(one, str) for one in listed)):
        raise ValueError(f"want an action, or a list of actions: {', '.join(Action)}")
    return listed


# one action, or several: the next is asked for where the one before does not come about
Ladder = Annotated[
    tuple[Annotated[Action, Strict(False)], ...], BeforeValidator(_listed), Strict(False), Field(min_length=1)
]


class Failsafe(Section):
    """`[failsafe]`: what the autopilot is asked to do, only while it is armed."""

    thruster_fault: Ladder = Field((Action.WARN,), description="at the onset of a FAULT of a thruster")
    thrusters_fault: Ladder | None = Field(
        None, description="while two or more thrusters are in FAULT; left out: as thruster_fault"
    )
    speed_fault: Ladder = Field((Action.WARN,), description="at the onset of a FAULT of the vehicle's speed")
    navigation_fault: Ladder = Field((Action.WARN,), description="at the onset of a FAULT of a navigation sensor")
    delay_s: float = Field(5.0, ge=0, le=60, description="from announcing to asking: the pilot can prevent it")
    interval_s: float = Field(60.0, ge=10, description="an action is never asked again sooner than this")


class Files(Section):
    """`[files]`"""

    findings: PathText = Field(Path("findings.jsonl"), description="findings, one JSON object a line")
    state: PathText = Field(Path("vehicle.state"), description="what was learnt, for the next start")
    save_every_s: float = Field(60.0, ge=1, description="time between two savings of the state")
    young_s: NotNegative = Field(
        600.0, description="levels, acknowledgements and mutes of a state older than this are not taken up again"
    )
    control: PathText = Field(Path("gateway.sock"), description="socket through which `gateway tell` speaks to it")


class Recording(Section):
    """`[recording]`: everything that came in, went out and was found, in MCAP files."""

    enabled: bool = Field(True, description="false = nothing is recorded")
    folder: PathText = Field(Path("recordings"), description="where the files lie")
    file_max_mb: float = Field(256.0, ge=1, le=16_384, description="MB after which a new file is begun")
    file_max_minutes: float = Field(60.0, ge=0.1, le=1440, description="minutes after which a new file is begun")
    budget_mb: float = Field(4096.0, ge=2, description="MB for all recordings: beyond it, the oldest are deleted")
    keep_free_mb: NotNegative = Field(
        500.0, description="MB of the disk that are left free: else nothing is recorded"
    )


class Metrics(Section):
    """`[metrics]`: figures for Prometheus. Without this table there are none."""

    port: int = Field(9464, ge=1, le=65_535, description="port of 127.0.0.1 that serves /metrics")
