"""How the water moves: constant, tidal, spatial, turning, setting in; and how it carries a vehicle along."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
WaterKind = Literal["constant", "tidal", "spatial", "turning", "setting in"]
# (M,) instants and (M, 2) places, north and east, to (M, 2) velocities
Water = Callable[[FloatArray, FloatArray], FloatArray]

M2_S, S2_S, K1_S, O1_S, M4_S = (3600.0 * hours for hours in (12.4206, 12.0, 23.9345, 25.8193, 6.2103))
EDDY_M = (20.0, 300.0)  # width, as the standard deviation of the Gaussian stream function
EDDIES = 4
FRONT_M = (30.0, 300.0)  # width of the front across which the flow is sheared
TURN_DEG = (20.0, 120.0)  # of a turning flow, in the whole mission
SETTING_IN_S = (5.0, 60.0)
SETTLED_S = 60.0  # before and after a flow sets in
CALM = 0.3  # at most so much of the flow is there before it sets in
WINDOW_S = 20.0
CLOSE_M = 1e-7
SWEEPS_MAX = 60


def random_water(
    rng: np.random.Generator, kind: WaterKind, speed_mps: float, time_s: FloatArray, reckoned_m: FloatArray
) -> Water:
    """Water of this kind that is nowhere and never faster than `speed_mps`.

    Args:
        rng: what it is drawn from.
        kind: of its changes.
        speed_mps: greatest speed.
        time_s: (M,) instants of the mission.
        reckoned_m: (M, 2) where the vehicle were in still water: eddies and fronts shall lie where it comes by.
    """
    flow_mps = speed_mps * _unit(rng.uniform(-np.pi, np.pi))
    return _KINDS[kind](rng, flow_mps, time_s, reckoned_m)


def carry(water: Water, time_s: FloatArray, through_mps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The way of a vehicle that moves through water that moves.

    Solved by Picard's iteration, window by window: within one, the way is guessed, the flow along it read, the way
    integrated (trapezoidal rule) and so on, until it stands still.

    Args:
        water: that carries it.
        time_s: (M,) instants.
        through_mps: (M, 2) velocity through the water.

    Returns:
        (M, 2) positions from the origin on, and (M, 2) velocity of the water there.
    """
    position_m, flow_mps = np.zeros_like(through_mps), np.zeros_like(through_mps)
    length = max(2, int(WINDOW_S / (time_s[1] - time_s[0])))
    for begin in range(0, len(time_s) - 1, length):
        part = slice(begin, begin + length + 1)
        position_m[part], flow_mps[part] = _swept(water, time_s[part], through_mps[part], position_m[begin])
    return position_m, flow_mps


def _swept(
    water: Water, time_s: FloatArray, through_mps: FloatArray, start_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    way_m = start_m + integral(time_s, through_mps)
    for _ in range(SWEEPS_MAX):
        flow_mps = water(time_s, way_m)
        before_m, way_m = way_m, start_m + integral(time_s, through_mps + flow_mps)
        if np.abs(way_m - before_m).max() < CLOSE_M:
            return way_m, flow_mps
    raise ArithmeticError(f"the way has not settled within {CLOSE_M} m after {SWEEPS_MAX} sweeps")


def integral(time_s: FloatArray, rate: FloatArray) -> FloatArray:
    """(M, 2) integral of (M, 2) rates from the first instant on, by the trapezoidal rule."""
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s)[:, np.newaxis]
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _unit(angle_rad: float) -> FloatArray:
    return np.array([np.cos(angle_rad), np.sin(angle_rad)])


def _constant(rng: np.random.Generator, flow_mps: FloatArray, time_s: FloatArray, reckoned_m: FloatArray) -> Water:
    return lambda time_s, place_m: np.broadcast_to(flow_mps, place_m.shape)


def _tidal(rng: np.random.Generator, flow_mps: FloatArray, time_s: FloatArray, reckoned_m: FloatArray) -> Water:
    """Tidal ellipses at some hour of the day; those of M4 are the ones that change within a mission."""
    periods_s = np.array([M2_S, S2_S, K1_S, O1_S, M4_S])
    shares = rng.dirichlet([4.0, 2.0, 1.0, 1.0, 1.0])
    phases_rad = rng.uniform(-np.pi, np.pi, len(periods_s))
    minor = rng.uniform(-0.6, 0.6, len(periods_s))  # minor axis over the major one; negative turns clockwise
    across_mps = np.array([-flow_mps[1], flow_mps[0]])

    def water(time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        angle_rad = 2.0 * np.pi * time_s[:, np.newaxis] / periods_s + phases_rad
        along, aside = np.cos(angle_rad) @ shares, np.sin(angle_rad) @ (shares * minor)
        return np.asarray(along[:, np.newaxis] * flow_mps + aside[:, np.newaxis] * across_mps)

    return water


def _spatial(rng: np.random.Generator, flow_mps: FloatArray, time_s: FloatArray, reckoned_m: FloatArray) -> Water:
    """A uniform part, a sheared one and Gaussian eddies, whose greatest speeds add up to that of the flow."""
    shares = rng.dirichlet([3.0, 1.0, *[0.5] * EDDIES])
    uniform_mps = shares[0] * flow_mps
    shear = _shear(rng, shares[1] * float(np.hypot(*flow_mps)))
    met_m = reckoned_m + uniform_mps * time_s[:, np.newaxis]
    peaks_mps = shares[2:] * np.hypot(*flow_mps) * rng.choice([-1.0, 1.0], EDDIES)
    eddies = _eddies(rng, peaks_mps, met_m)
    front_m = met_m[rng.integers(len(met_m))]
    return lambda time_s, place_m: uniform_mps + shear(place_m - front_m) + eddies(place_m)


def _shear(rng: np.random.Generator, peak_mps: float) -> Callable[[FloatArray], FloatArray]:
    """A front along which the water moves to the one side here and to the other there."""
    along = _unit(rng.uniform(-np.pi, np.pi))
    across = np.array([-along[1], along[0]])
    width_m = _log_uniform(rng, *FRONT_M)
    return lambda place_m: peak_mps * np.tanh((place_m @ across) / width_m)[:, np.newaxis] * along


def _eddies(rng: np.random.Generator, peaks_mps: FloatArray, met_m: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Water that turns around centres near the way, free of divergence."""
    widths_m = np.array([_log_uniform(rng, *EDDY_M) for _ in peaks_mps])
    offsets_m = widths_m[:, np.newaxis] * rng.standard_normal((len(peaks_mps), 2))
    centres_m = met_m[rng.integers(len(met_m), size=len(peaks_mps))] + offsets_m

    def water(place_m: FloatArray) -> FloatArray:
        from_centre = (place_m[:, np.newaxis, :] - centres_m) / widths_m[:, np.newaxis]
        # speed r exp((1 - r^2) / 2) is greatest, 1, at r = 1: one width from the centre
        rate = peaks_mps * np.exp(0.5 * (1.0 - (from_centre**2).sum(axis=2)))
        return np.stack([(-rate * from_centre[..., 1]).sum(axis=1), (rate * from_centre[..., 0]).sum(axis=1)], axis=1)

    return water


def _turning(rng: np.random.Generator, flow_mps: FloatArray, time_s: FloatArray, reckoned_m: FloatArray) -> Water:
    turn_radps = np.radians(rng.uniform(*TURN_DEG)) * rng.choice([-1.0, 1.0]) / time_s[-1]
    across_mps = np.array([-flow_mps[1], flow_mps[0]])

    def water(time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        angle_rad = turn_radps * time_s[:, np.newaxis]
        return np.asarray(np.cos(angle_rad) * flow_mps + np.sin(angle_rad) * across_mps)

    return water


def _setting_in(rng: np.random.Generator, flow_mps: FloatArray, time_s: FloatArray, reckoned_m: FloatArray) -> Water:
    calm = rng.uniform(0.0, CALM)
    lasts_s = rng.uniform(*SETTING_IN_S)
    begin_s = rng.uniform(SETTLED_S, time_s[-1] - SETTLED_S - lasts_s)

    def water(time_s: FloatArray, place_m: FloatArray) -> FloatArray:
        risen = np.clip((time_s - begin_s) / lasts_s, 0.0, 1.0)[:, np.newaxis]
        return np.asarray((calm + (1.0 - calm) * risen**2 * (3.0 - 2.0 * risen)) * flow_mps)

    return water


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


_KINDS: dict[WaterKind, Callable[[np.random.Generator, FloatArray, FloatArray, FloatArray], Water]] = {
    "constant": _constant,
    "tidal": _tidal,
    "spatial": _spatial,
    "turning": _turning,
    "setting in": _setting_in,
}
