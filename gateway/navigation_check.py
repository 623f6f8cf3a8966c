"""What the navigation watch will use of this vehicle, and what it can find with it: for `gateway check`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from detectors.navigation import NavigationConfig
from gateway.config_sections import Navigation
from gateway.sensor_watch import RATE_MIN_HZ
from gateway.wiring import INERTIAL_RATE_HZ

# What an inertial unit of at least this rate (Hz) is good for, the best first: see `gateway bench navigation`.
POSSIBLE: Mapping[float, str] = {
    50.0: "faults of DVL, depth sensor, gyroscope and accelerometer are found and told apart",
    25.0: "the same, and drifts in turns later",
    RATE_MIN_HZ: "faults of DVL and depth sensor are found, drifts on straight courses only",
}

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
    return "; ".join([*(f"from {rate_hz:g} Hz, {what}" for rate_hz, what in POSSIBLE.items()), "below, nothing"])


def _named(name: str, words: Mapping[str, str]) -> str:
    return "none" if name == "none" else words.get(name, name.upper())
