"""A simulated electric thruster: command in, propeller speed and current out, healthy or not.

The motor is a DC motor in disguise: the ESC applies a share (the duty) of the supply voltage, the voltage splits into
back-EMF and the drop over the windings, and the current balances the propeller's torque, which grows with n|n|:

    duty V = n / Kv + R (i_0 + k n^2)          steady state, solved exactly for n
    dn/dt = (n_steady - n) / tau               first-order lag, integrated exactly; tau is longer when coasting down
    i = (duty V - n / Kv) / R, 0 <= i <= limit  the ESC neither brakes into the battery nor exceeds its limit

So the signatures of the faults are not painted on: a braked propeller turns slower *and* draws more current, a bare
shaft turns faster and draws nearly none, and a sagging battery slows the speed down without any fault at all.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, exp, log, sqrt

import numpy as np

from hil_tests.rig.faults import FaultType, InjectedFault, strengths


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrusterParameters:
    """A Blue Robotics T200 on its Basic ESC at 16 V.

    Sources: the maker's technical details of the T200 (16 V, full throttle: about 3500 rpm, 24 A, 390 W, 5.25 kgf
    ahead and 4.1 kgf astern; dead band +-25 us of +-400 us; 14 poles; ESC limit 30 A) and of its motor, the M200
    (490 rpm/V, 0.18 ohm a phase, two phases in series). `torque_ahead_a_per_rpm2` is what balances those figures.
    Assumed, for the maker does not state them: the time constants, the delay, the torque astern and the noise.

    Attributes:
        speed_constant_rpm_per_v: Kv, no-load speed per volt.
        resistance_ohm: R, windings, wires and ESC.
        friction_a: i_0, current that only overcomes friction.
        torque_ahead_a_per_rpm2: k, motor current per squared speed, ahead.
        torque_astern_a_per_rpm2: the same astern: blades made for ahead need more torque for the same speed.
        thrust_ahead_n_per_rpm2: thrust per squared speed, ahead.
        thrust_astern_n_per_rpm2: the same astern.
        dead_band: fraction of full command around neutral in which the ESC stands still.
        current_limit_a: where the ESC limits the motor current.
        spin_up_s: time constant when the speed grows.
        coast_down_s: time constant when it falls.
        delay_s: transport delay from command to torque.
        nominal_supply_v: supply at which severities of faults are meant.
        resolution_rpm: unit of the ESC's speed report; 100 electrical rpm, 7 pole pairs.
        noise: standard deviation of the speed report, relative to the speed.
        current_noise_a: standard deviation of the current report.
        rated_power_w: at full throttle; what a load of 100 % is of.
        edges_per_turn: of the Hall sensors; three with two edges each for every pole pair.
    """

    speed_constant_rpm_per_v: float = 490.0
    resistance_ohm: float = 0.36
    friction_a: float = 0.3
    torque_ahead_a_per_rpm2: float = 1.97e-6
    torque_astern_a_per_rpm2: float = 2.17e-6
    thrust_ahead_n_per_rpm2: float = 4.2e-6
    thrust_astern_n_per_rpm2: float = 3.4e-6
    dead_band: float = 25.0 / 400.0
    current_limit_a: float = 30.0
    spin_up_s: float = 0.08
    coast_down_s: float = 0.12
    delay_s: float = 0.04
    nominal_supply_v: float = 16.0
    resolution_rpm: float = 100.0 / 7.0
    noise: float = 0.002
    current_noise_a: float = 0.05
    rated_power_w: float = 390.0
    edges_per_turn: int = 42

    def duty(self, command: float) -> float:
        """Share of the supply voltage that the ESC applies, 0 to 1, for a command of -1 to 1 (saturating)."""
        beyond = (min(abs(command), 1.0) - self.dead_band) / (1.0 - self.dead_band)
        return max(beyond, 0.0)

    def steady_speed_rpm(self, drive_v: float, torque_a_per_rpm2: float) -> float:
        """Speed at which drive voltage and load balance, >= 0.

        The positive root of R k n^2 + n / Kv = drive - R i_0, in the form that stays exact when k goes to zero.
        """
        available_v = max(drive_v - self.resistance_ohm * self.friction_a, 0.0)
        slope = 1.0 / self.speed_constant_rpm_per_v
        curvature = self.resistance_ohm * torque_a_per_rpm2
        return 2.0 * available_v / (slope + sqrt(slope * slope + 4.0 * curvature * available_v))

    def braking_for(self, loss: float) -> float:
        """How many times the healthy torque takes `loss` (0 to 0.95) of the full-throttle speed ahead away."""
        speed_rpm = (1.0 - loss) * self._full_speed_rpm()
        available_v = self.nominal_supply_v - self.resistance_ohm * self.friction_a
        load_v = available_v - speed_rpm / self.speed_constant_rpm_per_v
        return load_v / (self.resistance_ohm * self.torque_ahead_a_per_rpm2 * speed_rpm**2)

    def drive_for(self, loss: float) -> float:
        """The share of the drive voltage that is left when `loss` of the full-throttle speed ahead is gone."""
        speed_rpm = (1.0 - loss) * self._full_speed_rpm()
        current_a = self.friction_a + self.torque_ahead_a_per_rpm2 * speed_rpm**2
        left_v = speed_rpm / self.speed_constant_rpm_per_v + self.resistance_ohm * current_a
        return left_v / self.nominal_supply_v

    def thrust_n(self, speed_rpm: float) -> float:
        """Thrust at a speed in still water (bollard), signed like the speed."""
        ahead = speed_rpm >= 0.0
        factor = self.thrust_ahead_n_per_rpm2 if ahead else self.thrust_astern_n_per_rpm2
        return factor * speed_rpm * abs(speed_rpm)

    def _full_speed_rpm(self) -> float:
        return self.steady_speed_rpm(self.nominal_supply_v, self.torque_ahead_a_per_rpm2)


T200 = ThrusterParameters()


@dataclass(frozen=True, slots=True)
class ThrusterState:
    """The truth about a thruster at one instant.

    Attributes:
        speed_rpm: propeller speed, signed.
        healthy_rpm: what it would be now without any fault, from the same commands and supply.
        supply_a: current drawn from the supply.
    """

    speed_rpm: float
    healthy_rpm: float
    supply_a: float


@dataclass(frozen=True, slots=True)
class ThrusterMeasurement:
    """What the ESC reports: speed as its sensor sees it, supply current as its shunt sees it."""

    speed_rpm: float
    supply_a: float


class SimulatedThruster:
    """One thruster that is stepped at a fixed period.

    Args:
        period_s: time from step to step.
        seed: of its sensor noise.
        parameters: what thruster it is.
        faults: what happens to it.

    Raises:
        ValueError: `period_s` is not above zero.
    """

    def __init__(
        self,
        period_s: float,
        seed: int,
        parameters: ThrusterParameters = T200,
        faults: Sequence[InjectedFault] = (),
    ) -> None:
        if not period_s > 0.0:
            raise ValueError(f"period_s = {period_s}: want seconds above zero")
        self._period_s = period_s
        self._parameters = parameters
        self._faults = tuple(faults)
        self._random = np.random.default_rng(seed)
        later_s = max((fault.severity for fault in faults if fault.type is FaultType.DELAYED), default=0.0)
        longest = round((parameters.delay_s + later_s) / period_s)
        self._commands: deque[float] = deque([0.0] * (longest + 1), maxlen=longest + 1)
        self._ever_faulty = bool(faults)  # else it is its own healthy twin
        self._acting: dict[FaultType, float] = {}
        self._last_measured_rpm = 0.0
        self.state = ThrusterState(0.0, 0.0, 0.0)

    @property
    def thrust_n(self) -> float:
        """Thrust now, signed."""
        return self._parameters.thrust_n(self.state.speed_rpm)

    def step(self, time_s: float, command: float, supply_v: float, driven: bool = True) -> ThrusterState:
        """Advance by one period with a command of -1 to 1 (applied after the delay) and a supply voltage.

        Args:
            time_s: since the start.
            command: what the ESC is told.
            supply_v: at the ESC.
            driven: False while the ESC restarts.
        """
        self._commands.append(command)
        self._ever_faulty = self._ever_faulty or not driven
        self._acting = strengths(self._faults, time_s) if self._faults else {}
        obeyed = self._obeyed(self._acting.get(FaultType.DELAYED, 0.0))
        if FaultType.REVERSED in self._acting:
            obeyed = -obeyed
        drive_v = self._drive_v(obeyed, supply_v) if driven else 0.0
        slower = 1.0 + self._acting.get(FaultType.SLOW, 0.0)
        speed_rpm = self._advance(self.state.speed_rpm, self._target_rpm(obeyed, drive_v), slower)
        healthy_rpm = self._healthy_rpm(supply_v) if self._ever_faulty else speed_rpm
        self.state = ThrusterState(speed_rpm, healthy_rpm, self._supply_a(drive_v, supply_v, speed_rpm))
        return self.state

    def measure(self, window_s: float) -> ThrusterMeasurement:
        """What the ESC says now; `window_s` is the time over which it counts Hall pulses."""
        noisy_a = self.state.supply_a + self._parameters.current_noise_a * self._random.standard_normal()
        return ThrusterMeasurement(self._measure_rpm(window_s), noisy_a)

    def _obeyed(self, later_s: float) -> float:
        """The command that acts now."""
        waiting = round((self._parameters.delay_s + later_s) / self._period_s)
        return self._commands[-1 - waiting]

    def _healthy_rpm(self, supply_v: float) -> float:
        command = self._obeyed(0.0)
        target_rpm = self._free_target_rpm(command, self._parameters.duty(command) * supply_v, 1.0)
        return self._advance(self.state.healthy_rpm, target_rpm, 1.0)

    def _drive_v(self, command: float, supply_v: float) -> float:
        drive_v = self._parameters.duty(command) * supply_v
        if FaultType.WORN in self._acting:
            drive_v *= self._parameters.drive_for(self._acting[FaultType.WORN])
        return drive_v * (1.0 - self._acting.get(FaultType.DEAD, 0.0))

    def _target_rpm(self, command: float, drive_v: float) -> float:
        braking = 1.0
        if FaultType.ENTANGLED in self._acting:
            braking = self._parameters.braking_for(self._acting[FaultType.ENTANGLED])
        braking *= 1.0 - self._acting.get(FaultType.PROPELLER_LOST, 0.0)
        free = 1.0 - self._acting.get(FaultType.BLOCKED, 0.0)
        return free * self._free_target_rpm(command, drive_v, braking)

    def _free_target_rpm(self, command: float, drive_v: float, braking: float) -> float:
        parameters = self._parameters
        torque = parameters.torque_ahead_a_per_rpm2 if command >= 0.0 else parameters.torque_astern_a_per_rpm2
        return copysign(parameters.steady_speed_rpm(drive_v, braking * torque), command)

    def _advance(self, speed_rpm: float, target_rpm: float, slower: float) -> float:
        """Exact first-order step to a constant target, with time constants `slower` times as long; a reversal coasts
        to zero first, then spins up."""
        left_s = self._period_s
        if speed_rpm * target_rpm < 0.0:
            to_zero_s = slower * self._parameters.coast_down_s * log(1.0 - speed_rpm / target_rpm)
            if to_zero_s < left_s:
                speed_rpm, left_s = 0.0, left_s - to_zero_s
        growing = abs(target_rpm) > abs(speed_rpm) and speed_rpm * target_rpm >= 0.0
        time_constant_s = self._parameters.spin_up_s if growing else self._parameters.coast_down_s
        return target_rpm + (speed_rpm - target_rpm) * exp(-left_s / (slower * time_constant_s))

    def _supply_a(self, drive_v: float, supply_v: float, speed_rpm: float) -> float:
        """Supply current = duty x motor current: the ESC is a step-down converter."""
        parameters = self._parameters
        motor_a = (drive_v - abs(speed_rpm) / parameters.speed_constant_rpm_per_v) / parameters.resistance_ohm
        limited_a = min(max(motor_a, 0.0), parameters.current_limit_a)
        return limited_a * drive_v / supply_v if supply_v > 0.0 else 0.0

    def _measure_rpm(self, window_s: float) -> float:
        if FaultType.SENSOR_FROZEN in self._acting:
            return self._last_measured_rpm
        parameters = self._parameters
        seen_rpm = self.state.speed_rpm * (1.0 + parameters.noise * self._random.standard_normal())
        seen_rpm *= self._pulses_kept(window_s)
        self._last_measured_rpm = parameters.resolution_rpm * round(seen_rpm / parameters.resolution_rpm)
        return self._last_measured_rpm

    def _pulses_kept(self, window_s: float) -> float:
        lost = self._acting.get(FaultType.SENSOR_DROPPING, 0.0)
        pulses = round(abs(self.state.speed_rpm) / 60.0 * self._parameters.edges_per_turn * window_s)
        if lost == 0.0 or pulses == 0:
            return 1.0
        return 1.0 - float(self._random.binomial(pulses, lost)) / pulses
