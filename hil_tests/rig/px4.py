"""What PX4 does on an underwater vehicle, as far as a companion computer sees it.

Pure, as `hil_tests.rig.ardusub` is. From PX4's sources and documentation (commander, UUV airframes); it was not run.
There is no SURFACE: an underwater vehicle has manual, acro, stabilised, altitude and position modes, and that is all.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.commander import ALL_KNOWN, SURFACE_DEPTH_M, Commander, Estimates, Handler
from hil_tests.rig.commands import ACCEPTED, CUSTOM_MODE_ENABLED, FORCE, Answer, Command, Result, whole
from hil_tests.rig.esc_messages import ESC_INFO_ID, ESC_STATUS_ID
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion

REJECTED = Answer(Result.TEMPORARILY_REJECTED)


class MainMode(IntEnum):
    """PX4_CUSTOM_MAIN_MODE (commander/px4_custom_mode.h)."""

    MANUAL = 1
    ALTCTL = 2
    POSCTL = 3
    AUTO = 4
    ACRO = 5
    OFFBOARD = 6
    STABILIZED = 7


FLYABLE = frozenset({MainMode.MANUAL, MainMode.ALTCTL, MainMode.POSCTL, MainMode.ACRO, MainMode.STABILIZED})


def custom_mode(main: int, sub: int = 0) -> int:
    """HEARTBEAT.custom_mode of a main and a sub mode."""
    return sub << 24 | main << 16


class Px4(Commander):
    """See `Commander`.

    Args:
        mode: to begin with.
        armed: to begin with.
        estimates: what it knows of where it is.
    """

    autopilot = mavlink.MAV_AUTOPILOT_PX4
    streams: ClassVar[Mapping[int, float]] = {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: 1.0 / 15.0,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 0.2,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 1.0,
        mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 1.0,
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: 1.0,
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
        ESC_INFO_ID: 1.0,
        ESC_STATUS_ID: 1.0,
    }
    clock_request_s = 1.0

    def __init__(
        self, mode: MainMode = MainMode.MANUAL, armed: bool = True, estimates: Estimates = ALL_KNOWN
    ) -> None:
        super().__init__(armed, estimates)
        self.mode = mode
        self.terminated = False
        self._landed = False

    @property
    def custom_mode(self) -> int:
        """Main mode in the third byte; no mode of an underwater vehicle has a sub mode."""
        return custom_mode(self.mode)

    @property
    def mode_name(self) -> str:
        """As in px4_custom_mode.h."""
        return self.mode.name

    @property
    def system_status(self) -> int:
        """MAV_STATE; a terminated vehicle says so until it restarts."""
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION) if self.terminated else super().system_status

    @classmethod
    def modes(cls) -> Mapping[str, int]:
        """As in `Commander`."""
        return {mode.name: int(mode) for mode in MainMode if mode in FLYABLE}

    def demand(self, sticks: Sticks, motion: Motion) -> Sticks:
        """As in `Commander`."""
        self._landed = motion.down_m <= SURFACE_DEPTH_M
        if not self.armed or self.terminated:
            return Sticks()
        if self.mode is MainMode.ALTCTL:
            return self._keeper.hold_depth(sticks, motion)
        if self.mode is MainMode.POSCTL:
            return self._keeper.hold(sticks, motion)
        return sticks

    def restart(self) -> None:
        """As in `Commander`."""
        self.mode, self.armed, self.failsafe, self.terminated = MainMode.MANUAL, False, False, False
        self._keeper.release()

    def _answering(self) -> Mapping[int, Handler]:
        return {
            Command.DO_SET_MODE: self._do_set_mode,
            Command.NAV_LOITER_UNLIM: lambda _: REJECTED,
            Command.NAV_RETURN_TO_LAUNCH: lambda _: REJECTED,
            Command.NAV_LAND: lambda _: REJECTED,
            Command.DO_FLIGHTTERMINATION: self._terminate,
            Command.COMPONENT_ARM_DISARM: self._arm_disarm,
        }

    def _do_set_mode(self, parameters: tuple[float, ...]) -> Answer:
        main = whole(parameters[1])
        if not whole(parameters[0]) & CUSTOM_MODE_ENABLED or main not in set(MainMode):
            return REJECTED
        mode = MainMode(main)
        if not self._possible(mode):
            return REJECTED
        if mode is not self.mode:
            self.mode = mode
            self._keeper.release()
        return ACCEPTED

    def _possible(self, mode: MainMode) -> bool:
        if self.terminated or mode not in FLYABLE:
            return False
        needs = {MainMode.ALTCTL: self.estimates.depth, MainMode.POSCTL: self.estimates.position}
        return needs.get(mode, True)

    def _terminate(self, parameters: tuple[float, ...]) -> Answer:
        if not self.armed or parameters[0] <= 0.5:
            return Answer(Result.DENIED)
        self.terminated = True
        return ACCEPTED

    def _arm_disarm(self, parameters: tuple[float, ...]) -> Answer:
        if parameters[0] not in {0.0, 1.0}:
            return Answer(Result.UNSUPPORTED)
        disarming = parameters[0] == 0.0
        if disarming and self.armed and not self._landed and parameters[1] != FORCE:
            return Answer(Result.TEMPORARILY_REJECTED, "Disarming denied: not landed")
        self.armed = not disarming
        return ACCEPTED
