"""What two autopilots have in common as a companion computer sees them: modes, arming, a failsafe, answers.

Pure: no socket, no clock. `hil_tests.rig.ardusub` and `hil_tests.rig.px4` are the two.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.commands import CUSTOM_MODE_ENABLED, FORCE, Answer, Command, Result
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.station_keeping import StationKeeper
from hil_tests.rig.vehicle import Motion

SURFACE_DEPTH_M = 0.3

Handler = Callable[[tuple[float, ...]], Answer]


@dataclass(frozen=True, slots=True)
class Estimates:
    """What an autopilot knows of where it is: modes that hold something need to know it."""

    depth: bool = True
    position: bool = True


ALL_KNOWN = Estimates()


class Commander(ABC):
    """Mode and arming state, and the demand that they make of the sticks.

    Args:
        armed: to begin with.
        estimates: what it knows of where it is.

    Attributes:
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        streams: what it sends unasked, or can be asked for: seconds between two, by message id.
        clock_request_s: between its own TIMESYNC requests.
        armed: whether the thrusters may turn.
        failsafe: it is in a failsafe of its own.
        estimates: what it knows of where it is now.
    """

    autopilot: ClassVar[int]
    vehicle_type: ClassVar[int] = int(mavlink.MAV_TYPE_SUBMARINE)
    streams: ClassVar[Mapping[int, float]]
    clock_request_s: ClassVar[float]

    def __init__(self, armed: bool, estimates: Estimates) -> None:
        self.armed = armed
        self.failsafe = False
        self.estimates = estimates
        self._keeper = StationKeeper()
        self._handlers: Mapping[int, Handler] = self._answering()

    @property
    @abstractmethod
    def custom_mode(self) -> int:
        """HEARTBEAT.custom_mode."""

    @property
    @abstractmethod
    def mode_name(self) -> str:
        """The present mode in the autopilot's own words."""

    @property
    def system_status(self) -> int:
        """HEARTBEAT.system_status, a MAV_STATE."""
        if self.failsafe:
            return int(mavlink.MAV_STATE_CRITICAL)
        return int(mavlink.MAV_STATE_ACTIVE if self.armed else mavlink.MAV_STATE_STANDBY)

    @classmethod
    @abstractmethod
    def modes(cls) -> Mapping[str, int]:
        """Those that it can be driven in, in its own words, with what stands for them in param2 of DO_SET_MODE."""

    def select(self, mode_name: str) -> Answer:
        """The pilot asks for a mode.

        Raises:
            ValueError: there is no such mode.
        """
        modes = self.modes()
        if mode_name not in modes:
            raise ValueError(f"mode = {mode_name!r}: want one of {', '.join(modes)}")
        return self.answer(Command.DO_SET_MODE, (CUSTOM_MODE_ENABLED, modes[mode_name], 0.0, 0.0, 0.0, 0.0, 0.0))

    def arm(self, armed: bool) -> Answer:
        """The pilot arms or disarms, wherever the vehicle is."""
        return self.answer(Command.COMPONENT_ARM_DISARM, (float(armed), FORCE, 0.0, 0.0, 0.0, 0.0, 0.0))

    def answer(self, command: int, parameters: tuple[float, ...]) -> Answer:
        """Obey a COMMAND_LONG (seven parameters), or refuse it as this autopilot would."""
        handler = self._handlers.get(command)
        return handler(parameters) if handler else Answer(Result.UNSUPPORTED)

    @abstractmethod
    def demand(self, sticks: Sticks, motion: Motion) -> Sticks:
        """What the thrusters are to do, from the pilot's sticks and the vehicle's motion, in the present mode."""

    @abstractmethod
    def restart(self) -> None:
        """Begin anew, as after a loss of power: disarmed, in the mode that it starts in."""

    @abstractmethod
    def _answering(self) -> Mapping[int, Handler]:
        """What is done on which MAV_CMD."""
