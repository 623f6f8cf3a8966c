"""The paper's basis of the flow: Gaussian radial times tidal functions (paper 002, equation 6)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FlowBasis:
    """N functions of place and time, phi of paper 002, equation 6.

    phi_i(x, t) = exp(-|x - c_i| / (2 sigma_i)) cos(omega_i t + v_i), as it is printed: a cusp at the centre. With
    `squared` the first factor is the Gaussian that its name promises, exp(-|x - c_i|^2 / (2 sigma_i^2)): the width is
    squared with the norm, for only so it stays a length.

    Attributes:
        centres_m: c_i, (north, east) each.
        widths_m: sigma_i.
        frequencies_radps: omega_i; 0 for a function that is steady; none given: all are. Of the tide:
            `detectors.speed.tides.constituent`.
        phases_rad: v_i, at time 0; none given: all 0.
        squared: the norm squared instead of as printed.

    Raises:
        ValueError: no function, a number of widths, frequencies or phases that is not that of the centres, a width
            that is not above 0, or a value that is not finite.
    """

    centres_m: tuple[tuple[float, ...], ...]
    widths_m: tuple[float, ...]
    frequencies_radps: tuple[float, ...] = ()
    phases_rad: tuple[float, ...] = ()
    squared: bool = False
    _centres: FloatArray = field(init=False, repr=False, compare=False)
    _widths: FloatArray = field(init=False, repr=False, compare=False)
    _frequencies: FloatArray = field(init=False, repr=False, compare=False)
    _phases: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        count = len(self.centres_m)
        if count == 0 or any(len(centre) != 2 for centre in self.centres_m):
            raise ValueError(f"centres_m = {self.centres_m!r}: want one or more of (north, east)")
        rows = {
            "_widths": ("widths_m", self.widths_m),
            "_frequencies": ("frequencies_radps", self.frequencies_radps or (0.0,) * count),
            "_phases": ("phases_rad", self.phases_rad or (0.0,) * count),
        }
        for target, (name, values) in rows.items():
            _check_row(name, values, count)
            object.__setattr__(self, target, np.array(values, dtype=np.float64))
        _check_row("centres_m", [value for centre in self.centres_m for value in centre], 2 * count)
        if min(self.widths_m) <= 0.0:
            raise ValueError(f"widths_m = {self.widths_m!r}: want each above 0")
        object.__setattr__(self, "_centres", np.array(self.centres_m, dtype=np.float64))

    @property
    def size(self) -> int:
        """N."""
        return len(self.centres_m)

    @property
    def finest_m(self) -> float:
        """The least width: over a way much shorter than this no function changes much."""
        return min(self.widths_m)

    @property
    def fastest_radps(self) -> float:
        """The greatest frequency."""
        return float(np.abs(self._frequencies).max())

    def values(self, position_m: FloatArray, time_s: float) -> FloatArray:
        """(N,) the functions at a place and time.

        Args:
            position_m: (2,) north, east; what follows (down) has no part in it.
            time_s: of the clock to which the phases belong.
        """
        distance = np.hypot(*(position_m[:2] - self._centres).T)
        reach = 0.5 * (distance / self._widths) ** 2 if self.squared else distance / (2.0 * self._widths)
        turned: FloatArray = np.exp(-reach) * np.cos(self._frequencies * time_s + self._phases)  # (6)
        return turned


def _check_row(name: str, values: tuple[float, ...] | list[float], count: int) -> None:
    if len(values) != count:
        raise ValueError(f"{name} = {values!r}: want {count} values, one for each centre")
    if not all(isfinite(value) for value in values):
        raise ValueError(f"{name} = {values!r}: want finite values")
