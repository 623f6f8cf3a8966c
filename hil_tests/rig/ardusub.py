"""What ArduSub does, as far as a companion computer sees it: modes, arming, answers to commands.

Pure: no socket, no clock. The answers are those that were measured on ArduSub 4.7 in simulation; the control laws are
only good enough to make every mode move the simulated vehicle the way its name says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from math import cos, isfinite, sin

from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion

SURFACE_DEPTH_M = 0.3
STICK_CENTRED = 0.05


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


class Command(IntEnum):
    """The MAV_CMD that are answered here."""

    NAV_LOITER_UNLIM = 17
    NAV_LAND = 21
    DO_SET_MODE = 176
    DO_FLIGHTTERMINATION = 185
    COMPONENT_ARM_DISARM = 400


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of a command, and what the autopilot says to it (empty: nothing)."""

    result: Result
    text: str = ""


def whole(parameter: float) -> int:
    """A parameter that stands for a number of something; 0 where it is none."""
    return int(parameter) if isfinite(parameter) else 0


class ArduSub:
    """Mode and arming state, and the demand that they make of the sticks.

    Args:
        mode: to begin with.
        armed: to begin with.
    """

    def __init__(self, mode: Mode = Mode.MANUAL, armed: bool = True) -> None:
        self.mode = mode
        self.armed = armed
        self._target: Motion | None = None
        self._answers: dict[int, Callable[[tuple[float, ...]], Answer]] = {
            Command.DO_SET_MODE: self._do_set_mode,
            Command.NAV_LAND: lambda _: self._change_mode(Mode.SURFACE),
            Command.NAV_LOITER_UNLIM: lambda _: self._change_mode(Mode.POSHOLD),
            Command.DO_FLIGHTTERMINATION: self._terminate,
            Command.COMPONENT_ARM_DISARM: self._arm_disarm,
        }

    def answer(self, command: int, parameters: tuple[float, ...]) -> Answer:
        """Obey a COMMAND_LONG (seven parameters), or refuse it as ArduSub would."""
        handler = self._answers.get(command)
        return handler(parameters) if handler else Answer(Result.UNSUPPORTED)

    def demand(self, sticks: Sticks, motion: Motion) -> Sticks:
        """What the thrusters are to do, from the pilot's sticks and the vehicle's motion, in the present mode."""
        if self.mode is Mode.SURFACE and motion.down_m <= SURFACE_DEPTH_M:
            self._change_mode(Mode.ALT_HOLD)  # ArduSub hands over by itself (reason SURFACE_COMPLETE)
        if not self.armed:
            return Sticks()
        if self.mode is Mode.SURFACE:
            return replace(sticks, down=-0.5)
        if self.mode is Mode.ALT_HOLD:
            return replace(sticks, down=self._hold(sticks, motion).down)
        if self.mode is Mode.POSHOLD:
            return self._hold(sticks, motion)
        return sticks

    def _do_set_mode(self, parameters: tuple[float, ...]) -> Answer:
        custom_mode_enabled = whole(parameters[0]) & 1
        if not custom_mode_enabled:
            return Answer(Result.DENIED)
        number = whole(parameters[1])
        if number not in set(Mode):
            return Answer(Result.FAILED, f"No such mode {number}")
        return self._change_mode(Mode(number))

    def _change_mode(self, mode: Mode) -> Answer:
        if mode not in FLYABLE:
            return Answer(Result.FAILED, f"Mode change failed: {mode.name}")
        if mode is not self.mode:
            self.mode, self._target = mode, None
        return Answer(Result.ACCEPTED)

    def _terminate(self, parameters: tuple[float, ...]) -> Answer:
        if parameters[0] <= 0.5:
            return Answer(Result.FAILED)
        self.armed = False
        return Answer(Result.ACCEPTED)

    def _arm_disarm(self, parameters: tuple[float, ...]) -> Answer:
        if parameters[0] not in {0.0, 1.0}:
            return Answer(Result.UNSUPPORTED)
        self.armed = parameters[0] == 1.0
        return Answer(Result.ACCEPTED)

    def _hold(self, sticks: Sticks, motion: Motion) -> Sticks:
        """Keep the place, except along the axes on which the pilot has a hand; there the place moves along."""
        target = self._target or motion
        forward, right = _in_body(target.north_m - motion.north_m, target.east_m - motion.east_m, motion.yaw_rad)
        hands_on = max(abs(sticks.forward), abs(sticks.right)) > STICK_CENTRED
        down_on = abs(sticks.down) > STICK_CENTRED
        forward_mps, right_mps, down_mps = motion.over_ground_mps()
        self._target = replace(
            target,
            north_m=motion.north_m if hands_on else target.north_m,
            east_m=motion.east_m if hands_on else target.east_m,
            down_m=motion.down_m if down_on else target.down_m,
        )
        return Sticks(
            forward=sticks.forward if hands_on else _towards(forward, forward_mps),
            right=sticks.right if hands_on else _towards(right, right_mps),
            down=sticks.down if down_on else _towards(target.down_m - motion.down_m, down_mps),
            yaw=sticks.yaw,
        )


def _towards(distance_m: float, velocity_mps: float) -> float:
    """Proportional and damping, limited to half of the stick."""
    return max(-0.5, min(0.5, 0.6 * distance_m - 0.5 * velocity_mps))


def _in_body(north_m: float, east_m: float, yaw_rad: float) -> tuple[float, float]:
    cosine, sine = cos(yaw_rad), sin(yaw_rad)
    return cosine * north_m + sine * east_m, -sine * north_m + cosine * east_m
