"""What ArduSub does, as far as a companion computer sees it: modes, arming, answers to commands.

Pure: no socket, no clock. The answers are those that were measured on ArduSub 4.7 in simulation; the control laws are
only good enough to make every mode move the simulated vehicle the way its name says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import IntEnum
from math import inf
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.commander import ALL_KNOWN, SURFACE_DEPTH_M, Commander, Estimates, Handler
from hil_tests.rig.commands import ACCEPTED, CUSTOM_MODE_ENABLED, Answer, Command, Result, whole
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion


class Mode(IntEnum):
    """ArduSub's mode numbers (ArduSub/mode.h)."""

    STABILIZE = 0
    ACRO = 1
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    CIRCLE = 7
    SURFACE = 9
    POSHOLD = 16
    MANUAL = 19
    MOTOR_DETECT = 20
    SURFTRAK = 21


# AUTO, GUIDED, CIRCLE and the rest want a mission, a target or a motor test that this vehicle has not got.
FLYABLE = frozenset({Mode.STABILIZE, Mode.ACRO, Mode.ALT_HOLD, Mode.SURFACE, Mode.POSHOLD, Mode.MANUAL})
NEEDS_DEPTH = frozenset({Mode.ALT_HOLD, Mode.SURFACE, Mode.POSHOLD})


class ArduSub(Commander):
    """See `Commander`.

    Args:
        mode: to begin with.
        armed: to begin with.
        estimates: what it knows of where it is.
    """

    autopilot = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    streams: ClassVar[Mapping[int, float]] = {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: 0.1,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 1.0 / 3.0,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: inf,
        mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 0.5,
        mavlink.MAVLINK_MSG_ID_RAW_IMU: 0.5,
        mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2: 0.5,
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: inf,
    }
    clock_request_s = 10.0

    def __init__(self, mode: Mode = Mode.MANUAL, armed: bool = True, estimates: Estimates = ALL_KNOWN) -> None:
        super().__init__(armed, estimates)
        self.mode = mode

    @property
    def custom_mode(self) -> int:
        """The mode's number."""
        return int(self.mode)

    @property
    def mode_name(self) -> str:
        """As in ArduSub/mode.h."""
        return self.mode.name

    @classmethod
    def modes(cls) -> Mapping[str, int]:
        """As in `Commander`."""
        return {mode.name: int(mode) for mode in Mode if mode in FLYABLE}

    def demand(self, sticks: Sticks, motion: Motion) -> Sticks:
        """As in `Commander`."""
        if self.mode is Mode.SURFACE and motion.down_m <= SURFACE_DEPTH_M:
            self._change_mode(Mode.ALT_HOLD)  # ArduSub hands over by itself (reason SURFACE_COMPLETE)
        if not self.armed:
            return Sticks()
        if self.mode is Mode.SURFACE:
            return replace(sticks, down=-0.5)
        if self.mode is Mode.ALT_HOLD:
            return self._keeper.hold_depth(sticks, motion)
        if self.mode is Mode.POSHOLD:
            return self._keeper.hold(sticks, motion)
        return sticks

    def restart(self) -> None:
        """As in `Commander`: ArduSub starts in MANUAL."""
        self.mode, self.armed, self.failsafe = Mode.MANUAL, False, False
        self._keeper.release()

    def _answering(self) -> Mapping[int, Handler]:
        return {
            Command.DO_SET_MODE: self._do_set_mode,
            Command.NAV_LAND: lambda _: self._change_mode(Mode.SURFACE),
            Command.NAV_LOITER_UNLIM: lambda _: self._change_mode(Mode.POSHOLD),
            Command.DO_FLIGHTTERMINATION: self._terminate,
            Command.COMPONENT_ARM_DISARM: self._arm_disarm,
        }

    def _do_set_mode(self, parameters: tuple[float, ...]) -> Answer:
        if not whole(parameters[0]) & CUSTOM_MODE_ENABLED:
            return Answer(Result.DENIED)
        number = whole(parameters[1])
        if number not in set(Mode):
            return Answer(Result.FAILED, f"No such mode {number}")
        return self._change_mode(Mode(number))

    def _change_mode(self, mode: Mode) -> Answer:
        reason = self._obstacle(mode)
        if reason is not None:
            return Answer(Result.FAILED, f"Mode change failed: {mode.name}{reason}")
        if mode is not self.mode:
            self.mode = mode
            self._keeper.release()
        return ACCEPTED

    def _obstacle(self, mode: Mode) -> str | None:
        if mode not in FLYABLE:
            return ""
        if mode in NEEDS_DEPTH and not self.estimates.depth:
            return " need alt estimate"
        if mode is Mode.POSHOLD and not self.estimates.position:
            return " requires position"
        return None

    def _terminate(self, parameters: tuple[float, ...]) -> Answer:
        if parameters[0] <= 0.5:
            return Answer(Result.FAILED)
        self.armed = False
        return ACCEPTED

    def _arm_disarm(self, parameters: tuple[float, ...]) -> Answer:
        if parameters[0] not in {0.0, 1.0}:
            return Answer(Result.UNSUPPORTED)
        self.armed = parameters[0] == 1.0
        return ACCEPTED
