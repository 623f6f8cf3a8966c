"""Where the commands and speeds of thrusters are in the frames of one CAN bus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from drivers.can.load import BitRates

Protocol = Literal["dronecan", "dbc", "vesc"]
USUAL_RATES = BitRates(1_000_000)  # DroneCAN's recommendation, and ArduPilot's default


@dataclass(frozen=True, slots=True)
class CanSignals:
    """What is known of a bus; a bus of which nothing is known can have faults of frames only.

    Attributes:
        protocol: of its frames.
        rates: how fast it is.
    """

    protocol: Protocol = "dronecan"
    rates: BitRates = USUAL_RATES
