"""What the navigation watch will use of this vehicle, and what it can find with it: for `gateway check`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from detectors.navigation import NavigationConfig
from gateway.config_sections import Navigation
from gateway.sensor_watch import RATE_MIN_HZ
from gateway.streams import INERTIAL_RATE_HZ


@dataclass(frozen=True, slots=True)
class Trials:
    """Trial dives in which the DVL begins to drift by `DRIFT_MPS2`, with an inertial unit of this rate.

    Attributes:
        rate_hz: of the inertial unit.
        found: in so many dives the drift was found, with no alarm before.
        median_s: after which it was.
    """

    rate_hz: float
    found: int
    median_s: float


DRIFT_MPS2 = 0.04
# hil_tests.dives, seeds 0 to 5, 260 s each, the drift ahead from 200 s on; `gateway bench navigation` has more of it
DIVES = 6
TRIALS = (Trials(50.0, 5, 22.0), Trials(25.0, 5, 24.4), Trials(10.0, 6, 17.3))

# where the words of the configuration are not just names of messages
_IMUS: Mapping[str, str] = {"auto": "HIGHRES_IMU, else RAW_IMU, else SCALED_IMU to 3"}
_DVLS: Mapping[str, str] = {
    "auto": "VISION_POSITION_DELTA, else ODOMETRY",
    "vision_speed_estimate": "VISION_SPEED_ESTIMATE, taken as north, east, down",
}
_DEPTHS: Mapping[str, str] = {
    "auto": "SCALED_PRESSURE2, else SCALED_PRESSURE3, else the autopilot's own",
    "global_position": "the autopilot's own",
}
_FIXES: Mapping[str, str] = {
    "global_position": "the autopilot's own position, made from the same DVL: it cannot contradict it",
}


def sources(navigation: Navigation, settings: NavigationConfig) -> str:
    """What is used, in one line."""
    return "; ".join(_sources(navigation, settings))


def _sources(navigation: Navigation, settings: NavigationConfig) -> Iterator[str]:
    yield f"IMU: {_named(navigation.imu, _IMUS)}, asked for at {INERTIAL_RATE_HZ:g} Hz"
    yield f"DVL: {_named(navigation.dvl, _DVLS)}"
    yield f"depth: {_named(navigation.depth, _DEPTHS)}, water of {navigation.water_density_kgm3:g} kg/m3"
    yield f"fixes: {_named(navigation.fix, _FIXES)}"
    yield f"method: {settings.method}" + ("" if settings.isolate else ", nothing is isolated")


def possible() -> str:
    """What remains possible where a link gives less than is asked for."""
    trials = (f"at {one.rate_hz:g} Hz in {one.found}, after {one.median_s:.0f} s" for one in TRIALS)
    return (
        f"a DVL's drift of {DRIFT_MPS2:g} m/s/s was found, of {DIVES} dives, {', '.join(trials)} (median); "
        f"below {RATE_MIN_HZ:g} Hz nothing is judged"
    )


def _named(name: str, words: Mapping[str, str]) -> str:
    return "none" if name == "none" else words.get(name, name.upper())
