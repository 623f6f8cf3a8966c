"""The battery that all thrusters of a simulated vehicle hang on."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BatteryParameters:
    """The 4-cell lithium-ion battery of a BlueROV2, 14.8 V nominal, 18 Ah (maker's data). The resistance, with wiring
    and power module, is assumed: a sag of 1.5 V at 60 A."""

    full_v: float = 16.6
    empty_v: float = 12.0
    capacity_ah: float = 18.0
    resistance_ohm: float = 0.025


class Battery:
    """Voltage that falls with the load at once, and with the charge drawn over time."""

    def __init__(self, parameters: BatteryParameters | None = None) -> None:
        self._parameters = parameters or BatteryParameters()
        self._drawn_ah = 0.0
        self.voltage_v = self._parameters.full_v

    def step(self, current_a: float, period_s: float, sag_v: float = 0.0) -> float:
        """Draw a current for a while; returns the terminal voltage, `sag_v` lower than charge and load make it."""
        parameters = self._parameters
        self._drawn_ah = min(self._drawn_ah + current_a * period_s / 3600.0, parameters.capacity_ah)
        drawn_share = self._drawn_ah / parameters.capacity_ah
        open_circuit_v = parameters.full_v + (parameters.empty_v - parameters.full_v) * drawn_share
        self.voltage_v = max(open_circuit_v - parameters.resistance_ohm * current_a - sag_v, 0.0)
        return self.voltage_v
