"""Puts what inertial unit, DVL, depth sensor, attitude and fixes say into one row of samples, ordered by time.

- **Time.** What carries its sender's stamp is placed by that (`gateway.clock_offset`), all else by its reception. The
  autopilot's messages share one clock, its answers to TIMESYNC too; each sender of DVL messages has its own. (By half
  of TIMESYNC's round trip all could be put earlier still. It is not: a DVL without stamps, which comes over the same
  link, must not fall behind the inertial unit.)
- **Order.** A sample is held until the inertial unit's clock is `HOLD_S` past it, so that those which came over
  slower ways fall into their places. What is later still is refused and counted. At one time, the inertial sample is
  first.
- **Sources.** One inertial unit, one DVL and one depth sensor, as the configuration names them, or the best one alive
  (`gateway.source_choice`).
- **Depth** is water pressure above that of the air, by the density of the water; or the autopilot's own.
- **Rates.** Attitude and the autopilot's position, which change slowly or are made of the rest, are thinned out. A
  fix that repeats the place of the one before is no news: a USBL that lost its vehicle says the same for hours.
- Nothing raises on data; what is refused is counted in `drops`.
"""

from __future__ import annotations

from bisect import insort
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from math import inf

from detectors.navigation import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationSample,
)
from drivers.readings import (
    Attitude,
    AutopilotClock,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    PositionFix,
    WaterPressure,
)
from gateway.clock_offset import ClockOffset
from gateway.config_sections import Navigation
from gateway.source_choice import SourceChoice

HOLD_S = 0.1
WAITING_S = 2.0  # without inertial samples, all else waits in vain
ATTITUDE_PERIOD_S = 1.0  # a compass errs for tens of seconds: more often is not more
GLOBAL_FIX_PERIOD_S = 1.0

STANDARD_GRAVITY_MPS2 = 9.80665
AUTOPILOT = "autopilot"
GLOBAL_POSITION = "GLOBAL_POSITION_INT"

_RANKED_IMUS = ("HIGHRES_IMU", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")
_RANKED_DVLS = ("VISION_POSITION_DELTA", "ODOMETRY")
_RANKED_DEPTHS = ("SCALED_PRESSURE2", "SCALED_PRESSURE3", GLOBAL_POSITION)
_WORDS: Mapping[type[NavigationSample], str] = {
    ImuSample: "IMU",
    DvlSample: "DVL",
    DepthSample: "depth",
    FixSample: "fix",
    AttitudeSample: "attitude",
}
_MESSAGES: Mapping[str, str] = {"global_position": GLOBAL_POSITION, "gps_input": "GPS_INPUT"}

# time, 0 for inertial samples and 1 for all others, place in the order of arrival; then what it is about
_Waiting = tuple[float, int, int, NavigationSample]


class MotionAligner:
    """Readings in, samples out. See the module's text for the rules.

    Args:
        navigation: which sources, and the water.

    Attributes:
        imu, dvl, depth: choice of each source.
    """

    def __init__(self, navigation: Navigation) -> None:
        self.imu = SourceChoice(_ranked(navigation.imu, _RANKED_IMUS))
        self.dvl = SourceChoice(_ranked(navigation.dvl, _RANKED_DVLS))
        self.depth = SourceChoice(_ranked(navigation.depth, _RANKED_DEPTHS))
        self._fix = SourceChoice(_ranked(navigation.fix, ()))
        self._surface_pa = navigation.surface_pressure_pa
        self._pa_per_m = navigation.water_density_kgm3 * STANDARD_GRAVITY_MPS2
        self._drops: Counter[str] = Counter()
        self._clocks: defaultdict[str, ClockOffset] = defaultdict(ClockOffset)
        self._waiting: list[_Waiting] = []
        self._arrived = 0
        self._inertial_s = self._given_s = self._attitude_s = self._fix_s = -inf
        self._place: tuple[float, float] | None = None

    @property
    def drops(self) -> Counter[str]:
        """Refused inputs by cause."""
        return self._drops

    def inertial(self, reading: Inertial) -> list[NavigationSample]:
        """Takes an inertial reading; gives out the samples whose time has come."""
        if not self.imu.hears(reading.source, reading.time_s):
            return []
        time_s = self._stamped_s(AUTOPILOT, reading.boot_s, reading.time_s)
        if time_s <= self._inertial_s:
            self._drops["IMU time ran backwards"] += 1
            return []
        self._inertial_s = time_s
        self._wait(ImuSample(time_s, reading.specific_force_mps2, reading.angular_rate_radps), time_s)
        return self._due(time_s - HOLD_S)

    def velocity(self, reading: BodyVelocity) -> None:
        """Takes a DVL's velocity."""
        if self.dvl.hears(reading.source, reading.time_s):
            time_s = self._stamped_s(reading.source, reading.boot_s, reading.time_s)
            self._wait(DvlSample(time_s, reading.velocity_mps), time_s)

    def pressure(self, reading: WaterPressure) -> bool:
        """Takes a barometer's pressure; True where it may be that of the depth."""
        source = f"SCALED_PRESSURE{reading.instance if reading.instance > 1 else ''}"
        if self.depth.hears(source, reading.time_s):
            time_s = self._stamped_s(AUTOPILOT, reading.boot_s, reading.time_s)
            self._wait(DepthSample(time_s, (reading.pressure_pa - self._surface_pa) / self._pa_per_m), time_s)
        return self.depth.wants(source)

    def position(self, reading: GlobalPosition) -> bool:
        """Takes the autopilot's position: for depths, for fixes, for both, or for none; True where for depths."""
        time_s = self._stamped_s(AUTOPILOT, reading.boot_s, reading.time_s)
        if self.depth.hears(GLOBAL_POSITION, reading.time_s):
            self._wait(DepthSample(time_s, reading.depth_m), time_s)
        if self._fix.hears(GLOBAL_POSITION, reading.time_s) and time_s - self._fix_s >= GLOBAL_FIX_PERIOD_S:
            self._fixed(time_s, reading.latitude_rad, reading.longitude_rad)
        return self.depth.wants(GLOBAL_POSITION)

    def fix(self, reading: PositionFix) -> None:
        """Takes a fix of a positioning system."""
        if self._fix.hears(reading.source, reading.time_s):
            self._fixed(reading.time_s, reading.latitude_rad, reading.longitude_rad)

    def attitude(self, reading: Attitude) -> None:
        """Takes the autopilot's attitude."""
        time_s = self._stamped_s(AUTOPILOT, reading.boot_s, reading.time_s)
        if abs(time_s - self._attitude_s) >= ATTITUDE_PERIOD_S:
            self._attitude_s = time_s
            self._wait(AttitudeSample(time_s, (reading.roll_rad, reading.pitch_rad, reading.yaw_rad)), time_s)

    def clock(self, reading: AutopilotClock) -> None:
        """Takes what the autopilot's clock showed when it was asked: a stamp more to know the least delay from."""
        self._stamped_s(AUTOPILOT, reading.boot_s, reading.time_s)

    def restart(self) -> None:
        """The autopilot restarted: its clock began anew."""
        self._clocks.pop(AUTOPILOT, None)

    def _stamped_s(self, clock: str, boot_s: float | None, received_s: float) -> float:
        return received_s if boot_s is None else self._clocks[clock].time_s(boot_s, received_s)

    def _fixed(self, time_s: float, latitude_rad: float, longitude_rad: float) -> None:
        if (latitude_rad, longitude_rad) == self._place:
            self._drops["fix repeated"] += 1
            return
        self._place, self._fix_s = (latitude_rad, longitude_rad), time_s
        self._wait(FixSample(time_s, latitude_rad, longitude_rad), time_s)

    def _wait(self, sample: NavigationSample, time_s: float) -> None:
        if time_s < self._given_s:
            self._drops[f"{_WORDS[type(sample)]} late"] += 1
            return
        self._arrived += 1
        insort(self._waiting, (time_s, int(not isinstance(sample, ImuSample)), self._arrived, sample))
        while self._waiting[-1][0] - self._waiting[0][0] > WAITING_S:
            self._drops["without IMU"] += 1
            del self._waiting[0]

    def _due(self, until_s: float) -> list[NavigationSample]:
        count = 0
        while count < len(self._waiting) and self._waiting[count][0] <= until_s:
            count += 1
        if count:
            self._given_s = self._waiting[count - 1][0]
        due = [waiting[3] for waiting in self._waiting[:count]]
        del self._waiting[:count]
        return due


def _ranked(name: str, auto: Sequence[str]) -> Sequence[str]:
    if name == "none":
        return ()
    return auto if name == "auto" else (_MESSAGES.get(name, name.upper()),)
