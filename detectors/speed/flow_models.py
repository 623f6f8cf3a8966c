"""Outside models of a flow that is the same everywhere: a constant current and a tidal one (paper 002, F_M)."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, fmod, hypot, isfinite, sin, tau

import numpy as np
from numpy.typing import NDArray

from detectors.speed.tides import constituent

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ConstantFlow:
    """The same current at all times.

    Attributes:
        north_mps, east_mps, down_mps: velocity of the water.

    Raises:
        ValueError: a component that is not finite.
    """

    north_mps: float
    east_mps: float
    down_mps: float = 0.0

    def __post_init__(self) -> None:
        _want_finite(self, "north_mps", "east_mps", "down_mps")

    @classmethod
    def towards(cls, speed_mps: float, direction_rad: float) -> ConstantFlow:
        """A current that sets towards a true direction, clockwise from north: currents are named after it."""
        return cls(speed_mps * cos(direction_rad), speed_mps * sin(direction_rad))

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) velocity of the water at (D,) `position_m`."""
        return np.array((self.north_mps, self.east_mps, self.down_mps)[: len(position_m)])


@dataclass(frozen=True, slots=True)
class TidalConstituent:
    """What one constituent of the tide gives to the current at a place.

    North is north_mps cos(V - north_lag_rad) and so is east, with V the phase of the constituent. This is what
    an analysis of a current meter's record gives, and what atlases of tidal currents hold as amplitude and phase of u
    (east) and v (north).

    Attributes:
        name: M2, S2, K1... (`detectors.speed.tides`).
        north_mps, east_mps: amplitudes.
        north_lag_rad, east_lag_rad: phase lags; Greenwich phase lags, unless the flow has an epoch of its own.

    Raises:
        ValueError: an unknown constituent, a negative amplitude, a number that is not finite.
    """

    name: str
    north_mps: float
    north_lag_rad: float
    east_mps: float
    east_lag_rad: float

    def __post_init__(self) -> None:
        constituent(self.name)
        _want_finite(self, "north_mps", "north_lag_rad", "east_mps", "east_lag_rad")
        for key in ("north_mps", "east_mps"):
            if getattr(self, key) < 0:
                raise ValueError(f"{key} = {getattr(self, key)!r}: want 0 or more, with half a turn added to the lag")

    @classmethod
    def from_ellipse(
        cls, name: str, semi_major_mps: float, semi_minor_mps: float, inclination_rad: float, lag_rad: float
    ) -> TidalConstituent:
        """The constituent whose tidal ellipse is known, in the convention of T_TIDE and UTide (Foreman, 1978).

        Args:
            name: M2, S2, K1...
            semi_major_mps: largest speed.
            semi_minor_mps: smallest speed; positive where the current turns counter-clockwise, negative: clockwise.
            inclination_rad: of the major axis, counter-clockwise from east. From a true direction: pi/2 minus it.
            lag_rad: phase lag at which the current is largest towards the inclination.
        """
        along_east, along_north = semi_major_mps * cos(inclination_rad), semi_major_mps * sin(inclination_rad)
        across_east, across_north = -semi_minor_mps * sin(inclination_rad), semi_minor_mps * cos(inclination_rad)
        # along cos x + across sin x = hypot(along, across) cos(x - atan2(across, along)), x = V - lag
        return cls(
            name,
            hypot(along_north, across_north),
            lag_rad + atan2(across_north, along_north),
            hypot(along_east, across_east),
            lag_rad + atan2(across_east, along_east),
        )


@dataclass(frozen=True, slots=True)
class TidalFlow:
    """A current that turns with the tide: a mean and a sum of harmonic constituents.

    Attributes:
        mean_mps: (north, east) of the current that stays.
        constituents: what turns.
        epoch_s: None: lags are Greenwich phase lags and times are unix times, as in tide tables; each constituent's
            phase and its nodal corrections follow the sky. A time: lags count from there, all phases are zero then,
            and amplitudes are those of the days around it.

    Raises:
        ValueError: a constituent twice, or a number that is not finite.
    """

    mean_mps: tuple[float, float]
    constituents: tuple[TidalConstituent, ...]
    epoch_s: float | None = None

    def __post_init__(self) -> None:
        if len(self.mean_mps) != 2 or not all(map(isfinite, self.mean_mps)):
            raise ValueError(f"mean_mps = {self.mean_mps!r}: want two finite numbers, north and east")
        names = [each.name.upper() for each in self.constituents]
        if len(set(names)) != len(names):
            raise ValueError(f"constituents = {', '.join(names)}: want each once")
        if self.epoch_s is not None:
            _want_finite(self, "epoch_s")

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) velocity of the water at a unix time; none up or down."""
        north, east = self.mean_mps
        for each in self.constituents:
            factor, phase = self._phase(each.name, time_s)
            north += factor * each.north_mps * cos(phase - each.north_lag_rad)
            east += factor * each.east_mps * cos(phase - each.east_lag_rad)
        return np.array((north, east, 0.0)[: len(position_m)])

    def _phase(self, name: str, time_s: float) -> tuple[float, float]:
        """By how much the amplitude is to be multiplied, and the phase to take the lag from."""
        tide = constituent(name)
        if self.epoch_s is not None:
            return 1.0, fmod(tide.frequency_radps * (time_s - self.epoch_s), tau)
        factor, angle = tide.nodal(time_s)
        return factor, tide.argument_rad(time_s) + angle


def _want_finite(thing: object, *keys: str) -> None:
    for key in keys:
        if not isfinite(getattr(thing, key)):
            raise ValueError(f"{key} = {getattr(thing, key)!r}: want a finite number")
