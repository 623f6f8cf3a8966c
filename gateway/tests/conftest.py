"""A configuration, and a detector whose words a test decides."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from detectors.navigation import (
    DvlSample,
    NavigationConfig,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
    Sensor,
    SensorVerdict,
)
from detectors.navigation import (
    FaultKind as SensorFaultKind,
)
from detectors.navigation.installation import Installation
from detectors.speed import PoseSample, SpeedCurve, SpeedVerdict
from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from gateway import state
from gateway.channel import Learnt
from gateway.config import Config, parse
from gateway.moment import present

TWO_THRUSTERS = """
[vehicle]
name = "Test vehicle"

[[can]]
name = "can0"
interface = "virtual"
channel = "gateway tests"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:0"

[[thruster]]
number = 1
down = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }

[[thruster]]
number = 2
down = 1
command = { link = "mavlink", servo_channel = 3 }
rpm = { link = "can0", esc_index = 1 }

[align]
sample_rate_hz = 50
"""

SPEED_WATCH = """
[speed]
minimum_mps = 0.8
maximum_mps = 1.2
"""

NAVIGATION_WATCH = """
[navigation]
imu = "raw_imu"
"""

FULL_RPM = 3000.0
TOLERANCE_RPM = 150.0
WARMUP = 50


class ThresholdDetector:
    """A stand-in of the contract: it knows the curve, learns for 50 samples, then goes by the residual."""

    def __init__(self, config: object = None, commissioned: object = None) -> None:
        self.commissioned = commissioned
        self.samples = 0
        self.accepted = 0

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        self.samples += 1
        predicted_rpm = FULL_RPM * sample.command
        residual_rpm = sample.speed_rpm - predicted_rpm
        score = abs(residual_rpm) / TOLERANCE_RPM
        level = Level.FAULT if score > 1.0 else Level.SUSPECT if score > 0.5 else Level.NORMAL
        return verdict(
            sample.time_s,
            Level.UNKNOWN if self.samples <= WARMUP or not math.isfinite(score) else level,
            score=score,
            residual_rpm=residual_rpm,
            predicted_rpm=predicted_rpm,
            kind=FaultKind.ENTANGLED if level is Level.FAULT else FaultKind.NONE,
        )

    def run(self, *columns: np.ndarray) -> Rows:
        return Rows(self.update(ThrusterSample(*row)) for row in np.stack(columns, axis=1).tolist())

    def accept(self) -> None:
        self.accepted += 1

    def resume(self) -> None:
        pass


class Rows(list):
    """Verdicts of a block."""

    @property
    def level(self) -> np.ndarray:
        return np.array([int(one.level) for one in self], dtype=np.int64)

    def row(self, index: int) -> ThrusterVerdict:
        return self[index]


class GroundSpeedDetector:
    """A stand-in of the contract: it takes the speed over ground between two places for the one through the water."""

    def __init__(self, config: object = None, curve: SpeedCurve | None = None) -> None:
        self.config, self.curve = config, curve
        self.refused: Counter[str] = Counter()
        self.accepted = self.samples = self.resumed = 0
        self._last: PoseSample | None = None
        self._speed_mps = math.nan

    def update(self, sample: PoseSample) -> SpeedVerdict:
        self.samples += 1
        last, self._last = self._last, sample
        if last is not None and (sample.north_m, sample.east_m) != (last.north_m, last.east_m):
            way_m = math.hypot(sample.north_m - last.north_m, sample.east_m - last.east_m)
            self._speed_mps = way_m / (sample.time_s - last.time_s)
        known, healthy = math.isfinite(self._speed_mps), 0.8 <= self._speed_mps <= 1.2
        level = (Level.NORMAL if healthy else Level.FAULT) if known else Level.UNKNOWN
        return speed_verdict(sample.time_s, level, speed_mps=self._speed_mps)

    def accept(self) -> None:
        self.accepted += 1

    def resume(self) -> None:
        self.resumed += 1
        self._last, self._speed_mps = None, math.nan


TORN_MPS = 0.5


class CruiseDetector:
    """A stand-in of the contract: the vehicle makes 1 m/s ahead, and a DVL that says otherwise is isolated.

    One that is off by just `TORN_MPS` may as well be right.
    """

    def __init__(
        self, config: NavigationConfig, initial: NavigationState, installation: Installation | None = None
    ) -> None:
        self.config, self.initial = config, initial
        self.installation = Installation.of(config) if installation is None else installation
        self.recalled = installation is not None
        self.refused: Counter[str] = Counter()
        self.accepted = self.samples = 0
        self._error_mps = 0.0

    def update(self, sample: NavigationSample) -> NavigationVerdict:
        self.samples += 1
        if isinstance(sample, DvlSample):
            self._error_mps = sample.velocity_mps[0] - 1.0
        wrong, torn = abs(self._error_mps) > 0.2, abs(self._error_mps) == TORN_MPS
        if torn:
            unknown = SensorVerdict(Sensor.DVL, Level.UNKNOWN)
            return NavigationVerdict(
                time_s=sample.time_s,
                level=Level.FAULT,
                score=1.0,
                state=self.initial,
                sensors=(unknown,),
                reason="dvl or accelerometer",
            )
        dvl = SensorVerdict(
            Sensor.DVL,
            Level.FAULT if wrong else Level.NORMAL,
            score=abs(self._error_mps) / 0.2,
            kind=SensorFaultKind.STEP if wrong else None,
            size=(self._error_mps, 0.0, 0.0),
            isolated=wrong,
        )
        depth = SensorVerdict(Sensor.DEPTH, Level.NORMAL)
        return NavigationVerdict(
            time_s=sample.time_s, level=dvl.level, score=dvl.score, state=self.initial, sensors=(dvl, depth)
        )

    def accept(self) -> None:
        self.accepted += 1


def speed_verdict(time_s: float, level: Level, **fields: object) -> SpeedVerdict:
    """A verdict with what matters to a test; the rest is plausible."""
    plausible = {
        "score": 0.1,
        "speed_mps": 1.0,
        "flow_mps": (0.0, 0.4),
        "flag": int(level is Level.FAULT),
        "speed_min_mps": 0.8,
        "speed_max_mps": 1.2,
    }
    return SpeedVerdict(time_s=time_s, level=level, **{**plausible, **fields})


def verdict(time_s: float, level: Level, **fields: object) -> ThrusterVerdict:
    """A verdict with what matters to a test; the rest is plausible."""
    plausible = {
        "score": 0.1,
        "residual_rpm": 0.0,
        "predicted_rpm": 1000.0,
        "threshold_rpm": TOLERANCE_RPM,
        "order": 2,
        "window": 300,
        "delay": 2,
        "lag_s": 0.1,
        "refitted": False,
    }
    return ThrusterVerdict(time_s=time_s, level=level, **{**plausible, **fields})


FORECAST_START_S = 1_700_000_000.0


def write_forecast(path: Path, east_mps: float, start_s: float = FORECAST_START_S, hours: int = 48) -> None:
    """A current to the east, around Trondheim, by the CF conventions."""
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    shape = (2, 3, 3)
    east, north = np.full(shape, east_mps), np.zeros(shape)
    coordinates = {
        "time": ("time", [0.0, float(hours)], {"units": f"hours since {np.datetime64(round(start_s), 's')}"}),
        "lat": ("lat", [63.0, 63.5, 64.0], {"units": "degrees_north"}),
        "lon": ("lon", [10.0, 10.5, 11.0], {"units": "degrees_east"}),
    }
    names = {"uo": ("eastward", east), "vo": ("northward", north)}
    variables = {
        key: (("time", "lat", "lon"), values, {"standard_name": f"{towards}_sea_water_velocity", "units": "m s-1"})
        for key, (towards, values) in names.items()
    }
    xarray.Dataset(variables, coordinates).to_netcdf(path, engine="h5netcdf")


def over_the_disk(learnt: dict[str, Learnt]) -> dict[str, Learnt]:
    """What was learnt, as the next run of the program reads it."""
    return state.unpack(state.pack(state.State(present(), 1.7e9, learnt))).learnt


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return parse(TWO_THRUSTERS, tmp_path)


@pytest.fixture
def speed_config(tmp_path: Path) -> Config:
    return parse(
        TWO_THRUSTERS.replace("esc_index = 0 }\n", "esc_index = 0 }\nahead = 1\n", 1) + SPEED_WATCH, tmp_path
    )


@pytest.fixture
def navigation_config(tmp_path: Path) -> Config:
    return parse(TWO_THRUSTERS + NAVIGATION_WATCH, tmp_path)
