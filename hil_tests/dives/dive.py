"""Random dives: what the navigation detector is measured on beside recordings.

A dive is its seed: with an IMU of another rate, or with faults put into it, it is still the same vehicle, way and
sensors. "plain" dives have all sensors working; "rough" dives lose the bottom for seconds, and have single wrong and
lost samples as well, with nothing broken.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gateway.navigation_data import NavigationData
from hil_tests.dives.manoeuvres import VEHICLES, VehicleName, random_motion
from hil_tests.dives.motion import Motion
from hil_tests.dives.sensors import (
    IMU_HZ,
    Sensors,
    Vector,
    measured_depth,
    measured_inertial,
    measured_velocity,
    random_sensors,
    thinned,
)

FloatArray = NDArray[np.float64]
Style = Literal["plain", "rough"]

REFERENCE_HZ = 5.0
DVL_ARM_M: dict[VehicleName, Vector] = {"auv": (2.0, 0.2, 0.3), "rov": (0.3, 0.2, 0.3)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dive(NavigationData):
    """A simulated dive. Its reference, at `REFERENCE_HZ`, is exact.

    Attributes:
        seed, style, vehicle: that it was made from.
        motion: the truth at any instant.
        sensors: what was drawn of them.
    """

    seed: int
    style: Style
    vehicle: VehicleName
    motion: Motion
    sensors: Sensors

    @property
    def drawn(self) -> dict[str, float | Vector]:
        """What is peculiar to the sensors, by name."""
        return asdict(self.sensors)


def random_dive(
    seed: int,
    *,
    vehicle: VehicleName | None = None,
    style: Style = "plain",
    duration_s: float = 400.0,
    imu_hz: float = IMU_HZ,
    dvl_hz: float | None = None,
    depth_hz: float | None = None,
) -> Dive:
    """The dive of this seed.

    Args:
        seed: 0 or more; of even ones AUVs dive, of odd ones ROVs.
        vehicle: instead of that.
        style: "plain" or "rough", see above.
        duration_s: of the dive.
        imu_hz: rate of the IMU's samples, 100 Hz or a whole fraction of it; they are means then.
        dvl_hz, depth_hz: rates of the others, instead of what the seed draws.

    Raises:
        ValueError: an argument out of range.
    """
    name = vehicle if vehicle is not None else ("auv", "rov")[seed % 2]
    _check(seed, name, style, duration_s)
    _check_rates(dvl_hz, depth_hz)
    # one stream each, so that what one sensor draws moves no other
    streams = np.random.default_rng([get_args(VehicleName).index(name), seed]).spawn(5)
    motion = random_motion(streams[0], VEHICLES[name], duration_s)
    sensors = random_sensors(streams[1], DVL_ARM_M[name], rough=style == "rough")
    sensors = replace(
        sensors, dvl_rate_hz=dvl_hz or sensors.dvl_rate_hz, depth_rate_hz=depth_hz or sensors.depth_rate_hz
    )
    imu = measured_inertial(streams[2], sensors, motion, duration_s)
    return Dive(
        name=f"{name} {seed}" + (", rough" if style == "rough" else ""),
        imu=imu if imu_hz == IMU_HZ else thinned(imu, imu_hz),
        dvl=measured_velocity(streams[3], sensors, motion, duration_s),
        depth=measured_depth(streams[4], sensors, motion, duration_s),
        reference=_reference(motion, duration_s),
        seed=seed,
        style=style,
        vehicle=name,
        motion=motion,
        sensors=sensors,
    )


def _reference(motion: Motion, duration_s: float) -> FloatArray:
    """(R, 10) as `NavigationData` has it."""
    time_s = np.arange(0.0, duration_s, 1.0 / REFERENCE_HZ)
    attitude_rad = motion.frame(time_s).as_euler("ZYX")[:, ::-1]
    position = motion.position(time_s) * (1.0, 1.0, -1.0)
    return np.column_stack([time_s, position, motion.velocity_mps(time_s), attitude_rad])


def _check(seed: int, vehicle: str, style: str, duration_s: float) -> None:
    if seed < 0:
        raise ValueError(f"seed = {seed}: want 0 or more")
    if vehicle not in VEHICLES:
        raise ValueError(f"vehicle = {vehicle!r}: want one of {', '.join(VEHICLES)}")
    if style not in get_args(Style):
        raise ValueError(f"style = {style!r}: want one of {', '.join(get_args(Style))}")
    if not 10.0 <= duration_s <= 100_000.0:
        raise ValueError(f"duration_s = {duration_s}: want 10 to 100000")


def _check_rates(dvl_hz: float | None, depth_hz: float | None) -> None:
    for name, rate_hz in {"dvl_hz": dvl_hz, "depth_hz": depth_hz}.items():
        if rate_hz is not None and not 0.1 <= rate_hz <= 100.0:
            raise ValueError(f"{name} = {rate_hz}: want 0.1 to 100, or None")
