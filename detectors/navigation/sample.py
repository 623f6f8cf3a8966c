"""What the navigation detector wants, and what it says.

The frame of the earth is north-east-down, that of the body forward-right-down.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import inf, nan

from detectors.verdict import Level, Verdict

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Specific force and angular rate of the body, at any rate from 10 to 1000 Hz.

    Attributes:
        time_s: instant of the sample.
        specific_force_mps2: (3,) forward, right, down; at rest and level (0, 0, -9.8).
        angular_rate_radps: (3,) about the same axes.
    """

    time_s: float
    specific_force_mps2: Vector
    angular_rate_radps: Vector


@dataclass(frozen=True, slots=True)
class DvlSample:
    """Velocity over ground in the frame of the body, as a Doppler velocity log measures it."""

    time_s: float
    velocity_mps: Vector


@dataclass(frozen=True, slots=True)
class DepthSample:
    """Depth below the surface."""

    time_s: float
    depth_m: float


@dataclass(frozen=True, slots=True)
class FixSample:
    """Position on the earth (WGS 84) from an acoustic system or GPS."""

    time_s: float
    latitude_rad: float
    longitude_rad: float


@dataclass(frozen=True, slots=True)
class AttitudeSample:
    """(3,) roll, pitch, yaw as another system knows them, such as the autopilot: for the heading, which nothing else
    here measures."""

    time_s: float
    attitude_rad: Vector


NavigationSample = ImuSample | DvlSample | DepthSample | FixSample | AttitudeSample


@dataclass(frozen=True, slots=True)
class NavigationState:
    """Where a vehicle is, how it moves and how it lies.

    Attributes:
        time_s: instant.
        latitude_rad, longitude_rad: WGS 84.
        depth_m: below the surface.
        velocity_mps: (3,) north, east, down, over ground.
        attitude_rad: (3,) roll, pitch, yaw.
    """

    time_s: float
    latitude_rad: float
    longitude_rad: float
    depth_m: float
    velocity_mps: Vector
    attitude_rad: Vector


class Sensor(StrEnum):
    """A sensor that is judged."""

    DVL = "dvl"
    DEPTH = "depth"
    GYROSCOPE = "gyroscope"
    ACCELEROMETER = "accelerometer"


# The sensors whose samples are compared with what the others make expect, and which can be done without.
MEASURED: dict[Sensor, type[DvlSample | DepthSample]] = {Sensor.DVL: DvlSample, Sensor.DEPTH: DepthSample}


def measured_by(sample: NavigationSample) -> Sensor | None:
    """Which of them says such a sample; None for what is not judged."""
    return next((sensor for sensor, kind in MEASURED.items() if isinstance(sample, kind)), None)


class FaultKind(StrEnum):
    """How a sensor fails (paper 003, section 2, and what users report beyond it)."""

    STEP = "step"  # an offset that came at once
    DRIFT = "drift"  # an offset that grows
    STUCK = "stuck"  # the same value again and again; zero too
    NOISE = "noise"  # scatters more than it should
    SCALE = "scale"  # in proportion to what is measured
    INTERMITTENT = "intermittent"  # comes and goes
    UNCLEAR = "unclear"


@dataclass(frozen=True, slots=True)
class SensorVerdict:
    """What is said of one sensor.

    Attributes:
        sensor: which.
        level: UNKNOWN: not heard yet, silent, or something is wrong and this sensor is one of those that it may be.
        score: dimensionless evidence; 1.0 is the threshold of a FAULT.
        kind: how it fails; None while nothing is wrong with it.
        size: of the error now, (3,) forward, right, down in the sensor's unit (depth: the third only).
        rate: at which it grows, in the sensor's unit per second; 0.0 where it does not drift.
        isolated: its measurements are not used.
    """

    sensor: Sensor
    level: Level
    score: float = 0.0
    kind: FaultKind | None = None
    size: Vector = (0.0, 0.0, 0.0)
    rate: float = 0.0
    isolated: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationVerdict(Verdict):
    """What the navigation detector says of one sample. `level` and `score` are the worst of the sensors'.

    Attributes:
        innovation: (4,) newest DVL minus expected velocity, forward, right, down in m/s, and newest depth minus
            expected depth in m; NaN before the first, and where the sensor is silent.
        statistics: newest statistic of each method, as a share of its threshold, by the method's name.
        isolated: names of the sensors whose measurements are not used.
        state: where the vehicle is now, by what is left.
        sensors: one verdict for each sensor that was heard.
        position_error_m: standard deviation of the horizontal position, as the filter sees it.
        reason: why the level is UNKNOWN, SUSPECT or FAULT, in a few words; empty when NORMAL.
    """

    state: NavigationState
    innovation: tuple[float, float, float, float] = (nan, nan, nan, nan)
    statistics: Mapping[str, float] = field(default_factory=dict)
    isolated: tuple[str, ...] = ()
    sensors: tuple[SensorVerdict, ...] = ()
    position_error_m: float = inf
    reason: str = ""

    def of(self, sensor: Sensor) -> SensorVerdict:
        """What is said of one sensor; UNKNOWN for one that was never heard."""
        return next((one for one in self.sensors if one.sensor is sensor), SensorVerdict(sensor, Level.UNKNOWN))
