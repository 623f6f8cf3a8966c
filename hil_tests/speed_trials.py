"""The simulation and the blimp test of paper 002, rebuilt: where the vehicle is, what the flow is, what breaks.

The simulation is table 1 with what the text says of figures 1 and 2; open in it, and assumed here, are the normal
range (green lines without numbers) and the learnt speed at the start.

The blimp's recordings are not public. Taken from the text: its speed, the four basis functions, the zero parameters
at the start, the thruster disabled at 4 s, a fan, F_M from a measured wind with errors put in on purpose. The text
does not say, and assumed are: the wind's field and the start in it, a heading across the wind, learning rate, gain
and false alarm factor as in the simulation, the normal range, rate and noise of the motion capture, that a disabled
thruster stops the blimp at once, and that learning begins 4 s before the figure's zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import cos, exp, floor, pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from detectors.speed.basis import FlowBasis
from detectors.speed.config import SpeedConfig
from detectors.speed.flow import FlowModel
from detectors.speed.learnt_flow import FixedBasisFlow
from detectors.speed.sample import PoseSample

FloatArray = NDArray[np.float64]
OfTime = Callable[[float], float]

HOUR_S = 3600.0
TABLE_1_PERIODS_H = (12.42, 12.66, 12.0)  # M2, N2 and S2, as rounded there
TABLE_1_FLOW = ((0.9, 0.5, 0.7), (0.8, 0.5, 0.9))
TABLE_1_START = ((0.17, 0.2, 0.05), (0.07, 0.1, 0.1))
TABLE_1_CENTRES_M = ((0.0, 0.0), (10.0, 10.0), (5.0, 5.0))
BLIMP_SPEED_MPS = 0.0185
BLIMP_CENTRES_M = ((1.5594, 0.3), (2.0594, 0.3), (2.5594, 0.3), (1.5594, -1.5))
BLIMP_RANGE = 0.07  # half the normal range, as a part of the speed


@dataclass(frozen=True, slots=True, eq=False)
class SpeedTrial:
    """One vehicle's way through a flow, and what is true of it.

    Attributes:
        name: of the trial.
        samples: N, evenly spaced.
        speed_mps: (N,) true speed through the water (or air).
        flow_mps: (N, 2) true flow at the vehicle.
        fault_s: instant at which the speed falls.
        start_flow: xi(0) over the basis.
        start_mps: V_L(0).
        true_flow: theta; None where the flow is not of the basis.
        config: with gains, normal range and F_M.
    """

    name: str
    samples: tuple[PoseSample, ...]
    speed_mps: FloatArray
    flow_mps: FloatArray
    fault_s: float
    start_flow: FixedBasisFlow
    start_mps: float
    true_flow: FixedBasisFlow | None
    config: SpeedConfig


@dataclass(frozen=True, slots=True)
class FanWind:
    """Wind of a fan at (0.5, 0.3), along the first axis: a jet that widens, and the air that it draws along.

    Attributes:
        scale: 1 for the true wind; another for a measured one that is wrong by that.
        turned_rad: direction of the wind from the first axis.
    """

    scale: float = 1.0
    turned_rad: float = 0.0

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """As `FlowModel.velocity_mps`."""
        ahead_m, aside_m = max(float(position_m[0]) - 0.5, 0.0), float(position_m[1]) - 0.3
        jet = 0.3 * exp(-0.5 * (aside_m / (0.1 + 0.1 * ahead_m)) ** 2)
        blows_mps = self.scale * (0.3 + jet) / (1.0 + ahead_m)
        return np.array((blows_mps * cos(self.turned_rad), blows_mps * sin(self.turned_rad)))


def ocean_trial(rate_hz: float = 10.0, *, stepped: bool = False) -> SpeedTrial:
    """The simulation: 300 s at 1 m/s, and 0.5 m/s from 200 s on, in the flow of table 1, which F_M knows.

    Args:
        rate_hz: of the samples.
        stepped: the heading turns by 90 degrees every 20 s at once; else evenly, psi = pi / 2 t / 20 as printed.
    """
    frequencies = tuple(2.0 * pi / (hours * HOUR_S) for hours in TABLE_1_PERIODS_H)
    basis = FlowBasis(TABLE_1_CENTRES_M, (5.0, 5.0, 5.0), frequencies, (0.0, 0.0, 0.0))
    true_flow = FixedBasisFlow(basis, parameters=np.array(TABLE_1_FLOW))

    def heading(time_s: float) -> float:
        # a sample on the very turn comes after it, whatever its time was rounded to
        return pi / 2.0 * (floor(time_s / 20.0 + 1e-9) if stepped else time_s / 20.0)

    motion = _Motion(true_flow, heading, lambda time_s: 1.0 if time_s < 200.0 else 0.5)
    times = np.arange(round(300.0 * rate_hz) + 1) / rate_hz
    jumps = np.arange(20.0, 300.0, 20.0).tolist() if stepped else [200.0]
    positions = motion.way(np.zeros(2), times, jumps)
    return SpeedTrial(
        name=f"simulation, {rate_hz:g} Hz" + (", heading in steps" if stepped else ""),
        samples=motion.samples(times, positions),
        speed_mps=motion.speeds(times),
        flow_mps=motion.flows(times, positions),
        fault_s=200.0,
        start_flow=FixedBasisFlow(basis, parameters=np.array(TABLE_1_START)),
        start_mps=1.0,
        true_flow=true_flow,
        config=_config(basis, 0.8, 1.35, true_flow),
    )


def blimp_trial(seed: int = 0, *, half_range: float = BLIMP_RANGE) -> SpeedTrial:
    """The blimp: 0.0185 m/s across a fan's wind, none from 4 s on.

    Args:
        seed: of the motion capture's noise.
        half_range: half the normal range, as a part of the speed.
    """
    basis = FlowBasis(BLIMP_CENTRES_M, (1.0, 1.0, 1.0, 1.0))
    motion = _Motion(FanWind(), lambda _: pi / 2.0, lambda time_s: BLIMP_SPEED_MPS if time_s < 4.0 else 0.0)
    times = np.arange(1201) / 100.0 - 4.0
    positions = motion.way(np.array((1.2, -0.7)), times, [4.0])
    seen = positions + np.random.default_rng(seed).normal(0.0, 0.0005, positions.shape)
    low_mps, high_mps = BLIMP_SPEED_MPS * (1.0 - half_range), BLIMP_SPEED_MPS * (1.0 + half_range)
    return SpeedTrial(
        name="blimp",
        samples=motion.samples(times, seen),
        speed_mps=motion.speeds(times),
        flow_mps=motion.flows(times, positions),
        fault_s=4.0,
        start_flow=FixedBasisFlow(basis),
        start_mps=BLIMP_SPEED_MPS,
        true_flow=None,
        config=_config(basis, low_mps, high_mps, FanWind(scale=1.1, turned_rad=0.05)),
    )


def _config(basis: FlowBasis, low_mps: float, high_mps: float, flow_model: FlowModel) -> SpeedConfig:
    """With the simulation's gains."""
    return SpeedConfig(
        estimator="published",
        speed_min_mps=low_mps,
        speed_max_mps=high_mps,
        learning_rate=0.8,
        gain=1.0,
        basis=basis,
        flow_error_max=0.07,
        flow_model=flow_model,
    )


@dataclass(frozen=True, slots=True)
class _Motion:
    """Equation 1: flow, heading and speed over time."""

    flow: FlowModel
    heading_rad: OfTime
    speed_mps: OfTime

    def way(self, start_m: FloatArray, times: FloatArray, jumps_s: list[float]) -> FloatArray:
        """(N, 2) positions, integrated from jump to jump of heading or speed."""
        positions, position = np.tile(start_m, (len(times), 1)), start_m
        for begin_s, end_s in pairwise([float(times[0]), *jumps_s, float(times[-1])]):
            # the last stage of an integration stands on the jump, and is to be before it
            solved = solve_ivp(
                lambda t, x, last_s: self._velocity(t, min(t, last_s), x),
                (begin_s, end_s),
                position,
                dense_output=True,
                args=(end_s - 1e-6,),
                rtol=1e-9,
                atol=1e-10,
            )
            inside = (times > begin_s) & (times <= end_s)
            positions[inside] = solved.sol(times[inside]).T
            position = solved.y[:, -1]
        return positions

    def samples(self, times: FloatArray, positions: FloatArray) -> tuple[PoseSample, ...]:
        """N samples at these positions (N, 2)."""
        rows = zip(times.tolist(), positions.tolist(), strict=True)
        return tuple(PoseSample(t, north_m, east_m, self.heading_rad(t)) for t, (north_m, east_m) in rows)

    def speeds(self, times: FloatArray) -> FloatArray:
        return np.array([self.speed_mps(time_s) for time_s in times.tolist()])

    def flows(self, times: FloatArray, positions: FloatArray) -> FloatArray:
        rows = zip(times.tolist(), positions, strict=True)
        return np.array([self.flow.velocity_mps(time_s, position) for time_s, position in rows])

    def _velocity(self, time_s: float, before_jump_s: float, position_m: FloatArray) -> FloatArray:
        heading, speed = self.heading_rad(before_jump_s), self.speed_mps(before_jump_s)
        return self.flow.velocity_mps(time_s, position_m) + speed * np.array((cos(heading), sin(heading)))
