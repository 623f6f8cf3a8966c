"""Random manoeuvres: an AUV that surveys, and an ROV that looks around."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from hil_tests.dives.motion import Motion, motion_of

FloatArray = NDArray[np.float64]
Range = tuple[float, float]
VehicleName = Literal["auv", "rov"]

STEP_S = 0.1  # of the motion's splines; nothing here moves faster than within some tenths of a second
MARGIN_S = 2.0  # sensors look a little before and after their time
LATITUDE_RAD = (-1.1, 1.1)
DEPTH_M = (5.0, 60.0)  # vehicles turn back there
ROOM_M = 15.0  # they start so far from both


@dataclass(frozen=True, slots=True)
class Vehicle:
    """What a vehicle does, each quantity between two bounds.

    Attributes:
        speed_mps: forward. cruise_s: for which one is kept.
        sway_mps: sideways, on purpose.
        leg_s: between two turns. turn_radps: how fast they are. turn_rad: how far.
        level_s: between two changes of depth. dive_rad: pitch, or dive_mps: heave for them. dive_s: their duration.
        slip_s: velocity sideways in a turn, outwards, for each unit of its rate and of speed.
        bank_s: roll in a turn, inwards, likewise.
        swing_rad: standard deviation of roll and pitch while going straight on.
        waves_rad: greatest amplitude of roll and pitch in the swell. waves_mps: of heave and sway.
        answer_s: time constant of the answer to the helm. start_s: to a change of speed.
    """

    speed_mps: Range
    cruise_s: Range
    sway_mps: Range
    leg_s: Range
    turn_radps: Range
    turn_rad: Range
    level_s: Range
    dive_rad: Range
    dive_mps: Range
    dive_s: Range
    slip_s: Range
    bank_s: Range
    swing_rad: Range
    waves_rad: Range
    waves_mps: Range
    answer_s: Range
    start_s: Range


VEHICLES: dict[VehicleName, Vehicle] = {
    "auv": Vehicle(
        speed_mps=(1.0, 2.2), cruise_s=(60.0, 300.0), sway_mps=(0.0, 0.0),
        leg_s=(15.0, 90.0), turn_radps=(0.04, 0.3), turn_rad=(0.3, 3.2),
        level_s=(40.0, 200.0), dive_rad=(0.05, 0.3), dive_mps=(0.0, 0.0), dive_s=(8.0, 40.0),
        slip_s=(0.0, 0.5), bank_s=(-0.2, 0.4), swing_rad=(0.002, 0.01), waves_rad=(0.0, 0.02), waves_mps=(0.0, 0.05),
        answer_s=(0.8, 2.0), start_s=(3.0, 8.0),
    ),
    "rov": Vehicle(
        speed_mps=(0.0, 1.0), cruise_s=(8.0, 60.0), sway_mps=(-0.4, 0.4),
        leg_s=(5.0, 40.0), turn_radps=(0.05, 0.6), turn_rad=(0.2, 3.2),
        level_s=(15.0, 90.0), dive_rad=(0.0, 0.0), dive_mps=(0.1, 0.4), dive_s=(3.0, 25.0),
        slip_s=(0.0, 0.3), bank_s=(-0.1, 0.1), swing_rad=(0.003, 0.02), waves_rad=(0.0, 0.03), waves_mps=(0.0, 0.1),
        answer_s=(0.3, 1.0), start_s=(0.6, 2.0),
    ),
}  # fmt: skip


def random_motion(rng: np.random.Generator, vehicle: Vehicle, duration_s: float) -> Motion:
    """Somewhere on the earth, from `MARGIN_S` before the time 0 until as long after the end."""
    time_s = np.arange(-MARGIN_S, duration_s + MARGIN_S, STEP_S)
    answer_s, start_s = rng.uniform(*vehicle.answer_s), rng.uniform(*vehicle.start_s)
    turn_radps = _follow(_turns(rng, vehicle, time_s), answer_s)
    speed_mps = _follow(_levels(rng, vehicle.speed_mps, vehicle.cruise_s, time_s), start_s)
    sway_mps = _follow(_levels(rng, vehicle.sway_mps, vehicle.cruise_s, time_s), start_s)
    depth_m = rng.uniform(DEPTH_M[0] + ROOM_M, DEPTH_M[1] - ROOM_M)
    up = _dives(rng, vehicle, time_s, depth_m)
    swell = _Swell(rng, time_s)
    attitude_rad = [
        rng.uniform(*vehicle.bank_s) * turn_radps * speed_mps + _swing(rng, vehicle, time_s, swell),
        _follow(up * rng.uniform(*vehicle.dive_rad), answer_s) + _swing(rng, vehicle, time_s, swell),
        rng.uniform(-np.pi, np.pi) + cumulative_trapezoid(turn_radps, dx=STEP_S, initial=0.0),
    ]
    body_mps = [
        speed_mps,
        sway_mps - rng.uniform(*vehicle.slip_s) * turn_radps * speed_mps + swell(rng.uniform(*vehicle.waves_mps)),
        _follow(-up * rng.uniform(*vehicle.dive_mps), answer_s) + swell(rng.uniform(*vehicle.waves_mps)),
    ]
    start = rng.uniform(*LATITUDE_RAD), rng.uniform(-np.pi, np.pi), depth_m
    return motion_of(time_s, np.column_stack(attitude_rad), np.column_stack(body_mps), start)


class _Swell:
    """Waves of one sea: a few periods, each motion with its own phases."""

    def __init__(self, rng: np.random.Generator, time_s: FloatArray) -> None:
        self._rng, self._time_s = rng, time_s
        self._rates_radps = 2.0 * np.pi / rng.uniform(5.0, 10.0, 3)

    def __call__(self, amplitude: float) -> FloatArray:
        phases = self._rng.uniform(0.0, 2.0 * np.pi, 3)
        waves = np.sin(np.outer(self._time_s, self._rates_radps) + phases)
        return np.asarray(amplitude * waves.mean(axis=1))


def _turns(rng: np.random.Generator, vehicle: Vehicle, time_s: FloatArray) -> FloatArray:
    """(N,) turning rates as ordered: legs straight on, turns between them."""
    rates = np.zeros_like(time_s)
    now_s = rng.uniform(*vehicle.leg_s)
    while now_s < time_s[-1]:
        rate_radps, turn_rad = rng.uniform(*vehicle.turn_radps), rng.uniform(*vehicle.turn_rad)
        end_s = now_s + turn_rad / rate_radps
        rates[(time_s >= now_s) & (time_s < end_s)] = rng.choice([-1.0, 1.0]) * rate_radps
        now_s = end_s + rng.uniform(*vehicle.leg_s)
    return rates


def _levels(rng: np.random.Generator, bounds: Range, kept_s: Range, time_s: FloatArray) -> FloatArray:
    """(N,) one constant after the other."""
    levels = np.zeros_like(time_s)
    now_s = float(time_s[0])
    while now_s < time_s[-1]:
        levels[time_s >= now_s] = rng.uniform(*bounds)
        now_s += rng.uniform(*kept_s)
    return levels


def _dives(rng: np.random.Generator, vehicle: Vehicle, time_s: FloatArray, depth_m: float) -> FloatArray:
    """(N,) 1 while going up, -1 while going down, 0 on the level; back where it gets too deep or too shallow."""
    up = np.zeros_like(time_s)
    fastest_mps = max(vehicle.speed_mps[1] * np.sin(vehicle.dive_rad[1]), vehicle.dive_mps[1])
    now_s = rng.uniform(*vehicle.level_s)
    while now_s < time_s[-1]:
        duration_s = rng.uniform(*vehicle.dive_s)
        way = rng.choice([-1.0, 1.0])
        if not DEPTH_M[0] < depth_m - way * fastest_mps * duration_s < DEPTH_M[1]:
            way = -way
        depth_m -= way * fastest_mps * duration_s
        up[(time_s >= now_s) & (time_s < now_s + duration_s)] = way
        now_s += duration_s + rng.uniform(*vehicle.level_s)
    return up


def _swing(rng: np.random.Generator, vehicle: Vehicle, time_s: FloatArray, swell: _Swell) -> FloatArray:
    """(N,) roll or pitch of a hull that goes straight on."""
    white = rng.standard_normal(len(time_s))
    slow = _follow(white, 0.5)
    swing_rad = rng.uniform(*vehicle.swing_rad) * slow / slow.std()
    return np.asarray(swing_rad + swell(rng.uniform(*vehicle.waves_rad)))


def _follow(ordered: FloatArray, time_constant_s: float) -> FloatArray:
    """(N,) what comes of orders: three lags in a row, so that even the change of acceleration has no jump."""
    share = -np.expm1(-3.0 * STEP_S / time_constant_s)
    followed = ordered
    for _ in range(3):
        start = (1.0 - share) * followed[:1]
        followed = lfilter([share], [1.0, share - 1.0], followed, zi=start)[0]
    return np.asarray(followed)
