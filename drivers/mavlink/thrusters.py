"""Where a thruster's command and speed are found in the autopilot's messages."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.command import CommandScale

# of one report, or (N,) of many
Speed = TypeVar("Speed", int, NDArray[np.float64])

CHANNELS_PER_PORT = 16  # of SERVO_OUTPUT_RAW
ACTUATORS = 32  # of ACTUATOR_OUTPUT_STATUS
ESC_INDEX_MAX = 63
CELSIUS_ZERO_K = 273.15

# 65535 is a saturated counter. No propeller turns nearly as fast, but a geared or bare motor's ESC may report 50000.
SPEED_MAX_RPM = 65_534
VOLTAGE_MAX_V = 655.35  # a saturated uint16 of centivolts
CURRENT_MAX_A = 655.35
TEMPERATURE_MAX_C = 200  # ArduPilot squeezes negative temperatures into a uint8 as well: they come out above this


@dataclass(frozen=True, slots=True)
class MavlinkThruster:
    """Where one thruster's command and speed are found in the autopilot's messages.

    Attributes:
        thruster: its number in the configuration, from 1.
        servo_channel: 1..32, the output in SERVO_OUTPUT_RAW; None: the command comes from elsewhere.
        command_scale: from the unit of the wire to a fraction of full thrust; given exactly where a command is.
        esc_index: 0-based over all ESC_TELEMETRY_* (or PX4's ESC_STATUS) messages; None: no ESC telemetry. It is the
            number in the messages: ArduPilot has taken its ESC_TLM_MAV_OFS off.
        signed: True where ESC_STATUS carries the direction (ESC_TELEMETRY_* never does: ArduPilot sends magnitudes).
        reverse: True where a positive reported speed drives astern; only for a signed one.
        rpm_sensor: 1 or 2, the instance in RPM, for a speed sensor of its own in place of an ESC's.
        actuator: 1..32, the output in PX4's ACTUATOR_OUTPUT_STATUS, in place of a servo channel. Its unit is that of
            the output's driver: microseconds of a PWM output, counts of a CAN one.

    Raises:
        ValueError: out of these bounds.
    """

    thruster: int
    servo_channel: int | None = None
    command_scale: CommandScale | None = None
    esc_index: int | None = None
    signed: bool = False
    reverse: bool = False
    rpm_sensor: int | None = None
    actuator: int | None = None

    def __post_init__(self) -> None:
        for name, value, lowest, highest in (
            ("thruster", self.thruster, 1, math.inf),
            ("servo_channel", self.servo_channel, 1, 2 * CHANNELS_PER_PORT),
            ("esc_index", self.esc_index, 0, ESC_INDEX_MAX),
            ("rpm_sensor", self.rpm_sensor, 1, 2),
            ("actuator", self.actuator, 1, ACTUATORS),
        ):
            if value is not None and not lowest <= value <= highest:
                raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value}")
        if self.servo_channel is not None and self.actuator is not None:
            raise ValueError(f"one source of commands: servo_channel or actuator, got {self}")
        if (self.servo_channel is None and self.actuator is None) != (self.command_scale is None):
            raise ValueError(f"servo_channel or actuator and command_scale come together or not at all, got {self}")
        if self.esc_index is not None and self.rpm_sensor is not None:
            raise ValueError(f"one source of speed: esc_index or rpm_sensor, got {self}")

    def directed(self, rpm: Speed) -> Speed:
        """A speed that was reported, positive ahead; the magnitude where its sign says nothing."""
        if not self.signed:
            return abs(rpm)
        return -rpm if self.reverse else rpm
