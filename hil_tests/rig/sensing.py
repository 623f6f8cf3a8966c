"""The sensors of a simulated vehicle as its profile has them, and the messages of those that speak for themselves."""

from __future__ import annotations

from typing import Any

from hil_tests.rig import acoustic, dvl
from hil_tests.rig.acoustic import AcousticSystem
from hil_tests.rig.instruments import Equipment, Instruments
from hil_tests.rig.navigation import NavigationFilter
from hil_tests.rig.profile import Profile
from hil_tests.rig.vehicle import Motion

# of pymavlink, with component and system id; None: the vehicle's
Said = tuple[Any, int, int | None]


class Sensing:
    """The sensors, and who tells of them.

    Args:
        profile: of the vehicle.
        seed: of all noise.
        at_first: how it moves at the start.

    Attributes:
        filter: of the autopilot, for position and attitude.
        instruments: that it reads; None: none of which it tells.
    """

    def __init__(self, profile: Profile, seed: int, at_first: Motion) -> None:
        sensors = profile.sensors
        equipment = Equipment(imu=sensors.imu, dvl=sensors.dvl, pressure=sensors.pressure)
        self.filter = NavigationFilter(sensors.navigation, seed)
        self.instruments = Instruments(equipment, seed, at_first)
        self._acoustic = AcousticSystem(sensors.acoustic, seed) if sensors.acoustic else None

    def messages(self, since_s: float, time_s: float, motion: Motion, step_s: float) -> list[Said]:
        """Feel a step; messages of sensors that speak for themselves, each with component and system id."""
        self.instruments.step(motion, step_s)
        said: list[Said] = []
        velocity = self.instruments.vision_position_delta(since_s)
        if velocity:
            said.append((velocity, dvl.COMPONENT_ID, dvl.SYSTEM_ID))
        fix = self._acoustic and self._acoustic.due(since_s, time_s, motion)
        if fix:
            said.append((fix, acoustic.COMPONENT_ID, None))
        return said
