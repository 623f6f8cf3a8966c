"""A track from above, north up, as marks: the way, when the vehicle was where, and where something was wrong."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gateway.plotting.clock import clock
from gateway.plotting.extent import time_ticks
from gateway.plotting.figure import Arrows, Colour, FloatArray, Line, Mark, Points
from gateway.report.drawable import where

TIMES_MAX = 8
ARROWS_MAX = 24
ARROW_SHARE = 0.12  # of the track's extent, for the strongest flow
# less than this is drawn shorter; nothing is drawn of what is still
WEAK_MPS, STILL_MPS = 0.2, 0.01
STRIKING = 4.0  # width of a stretch of the track


def way(name: str, time_s: FloatArray, north_m: FloatArray, east_m: FloatArray) -> Iterator[Mark]:
    """The track (N,) itself, with times along it."""
    yield Line(name, east_m, north_m, Colour.MEASURED)
    known = np.flatnonzero(np.isfinite(north_m) & np.isfinite(east_m))
    if not len(known):
        return
    first, last = known[0], known[-1]
    ticks_s = time_ticks(float(time_s[first]), float(time_s[last]), TIMES_MAX)
    at = known[np.searchsorted(time_s[known], ticks_s).clip(max=len(known) - 1)]
    yield Points("time", east_m[at], north_m[at], Colour.FAINT, tuple(clock(float(one)) for one in ticks_s))
    yield Points("begin", east_m[[first]], north_m[[first]], Colour.NORMAL)
    yield Points("end", east_m[[last]], north_m[[last]], Colour.COMMAND)


def stretch(
    name: str, chosen: NDArray[np.bool_], north_m: FloatArray, east_m: FloatArray, colour: Colour
) -> Iterator[Mark]:
    """Where on the track something was; nothing where it never was."""
    if chosen.any():
        yield Line(name, where(chosen, east_m), where(chosen, north_m), colour, width=STRIKING)


def flow_arrows(
    flow_mps: FloatArray, trusted: NDArray[np.bool_], north_m: FloatArray, east_m: FloatArray
) -> Iterator[Mark]:
    """The flow (N, 2) along the track, at places evenly apart on it; the longest arrow tells the scale."""
    at = _apart(north_m, east_m, trusted & np.isfinite(flow_mps).all(axis=1))
    speed_mps = np.hypot(flow_mps[at, 0], flow_mps[at, 1])
    strongest_mps = float(speed_mps.max(initial=0.0))
    if strongest_mps < STILL_MPS:
        return
    extent_m = max(_extent(north_m), _extent(east_m), 1.0)
    dn_m, de_m = (ARROW_SHARE * extent_m / max(strongest_mps, WEAK_MPS) * flow_mps[at]).T
    labels = tuple(_flow_words(float(north), float(east)) for north, east in flow_mps[at])
    yield Arrows(f"flow, up to {strongest_mps:.2f} m/s", east_m[at], north_m[at], de_m, dn_m, Colour.OTHER, labels)


def _flow_words(north_mps: float, east_mps: float) -> str:
    towards_deg = round(np.degrees(np.arctan2(east_mps, north_mps))) % 360
    return f"flow {np.hypot(north_mps, east_mps):.2f} m/s towards {towards_deg:03d}°"


def _apart(north_m: FloatArray, east_m: FloatArray, chosen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Indices of chosen samples that are about as far from each other along the way."""
    indices: NDArray[np.intp] = np.flatnonzero(chosen & np.isfinite(north_m) & np.isfinite(east_m))
    if not len(indices):
        return indices
    steps_m = np.hypot(np.diff(north_m[indices]), np.diff(east_m[indices]))
    come_m = np.concatenate(([0.0], np.cumsum(steps_m)))
    wanted_m = np.linspace(0.0, come_m[-1], min(ARROWS_MAX, len(indices)))
    places: NDArray[np.intp] = np.unique(np.searchsorted(come_m, wanted_m).clip(max=len(indices) - 1))
    return np.take(indices, places)


def _extent(value: FloatArray) -> float:
    known = value[np.isfinite(value)]
    return float(np.ptp(known)) if len(known) else 0.0
