"""Harmonic constituents of the tide: how fast each turns, and where it stands at an instant.

A tide is a sum of cosines, f H cos(V + u - g): H and g are of the place (amplitude and Greenwich phase lag, from
a tide table or an analysis), V is of the sky, and f and u, the nodal corrections, follow the 18.6 years in which the
Moon's orbit turns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, radians, sin, tau
from types import MappingProxyType

DoodsonNumbers = tuple[int, int, int, int, int, int]

J2000_UNIX_S = 946_728_000.0
_CENTURY_S = 36_525 * 86_400.0
_DAY_S = 86_400.0

# Mean longitudes: degrees at noon of 1 January 2000, and degrees a Julian century
# (J. Meeus, Astronomical Algorithms, 2nd edition, chapters 22, 25 and 47).
_MOON = (218.3164477, 481267.88123421)  # s
_SUN = (280.46646, 36000.76983)  # h
_LUNAR_PERIGEE = (83.3532465, 4069.0137287)  # p
_LUNAR_NODE = (125.04452, -1934.136261)  # N
_SOLAR_PERIGEE = (282.93735, 1.71946)  # p1


@dataclass(frozen=True, slots=True)
class NodalSeries:
    """f and u of one constituent as series in N, the longitude of the Moon's ascending node.

    f = factor[0] + factor[1] cos N + factor[2] cos 2N + ...; u = angle_deg[0] sin N + angle_deg[1] sin 2N + ...
    (A. T. Doodson and H. D. Warburg, Admiralty Manual of Tides, 1941, as in D. T. Pugh, Tides, Surges and Mean
    Sea-Level, 1987, table 4.3).
    """

    factor: tuple[float, ...]
    angle_deg: tuple[float, ...]

    def at(self, node_rad: float) -> tuple[float, float]:
        """f and u (rad), for the longitude N of the node."""
        factor = sum(c * cos(n * node_rad) for n, c in enumerate(self.factor))
        angle = sum(c * sin(n * node_rad) for n, c in enumerate(self.angle_deg, start=1))
        return factor, radians(angle)


_M2 = NodalSeries((1.0004, -0.0373, 0.0002), (-2.14,))
_K2 = NodalSeries((1.0241, 0.2863, 0.0083, -0.0015), (-17.74, 0.68, -0.04))
_K1 = NodalSeries((1.0060, 0.1150, -0.0088, 0.0006), (-8.86, 0.68, -0.07))
_O1 = NodalSeries((1.0089, 0.1871, -0.0147, 0.0014), (10.80, -1.34, 0.19))
_J1 = NodalSeries((1.0129, 0.1676, -0.0170, 0.0016), (-12.94, 1.34, -0.19))
_OO1 = NodalSeries((1.1027, 0.6504, 0.0317, -0.0014), (-36.68, 4.02, -0.57))
_MM = NodalSeries((1.0000, -0.1300, 0.0013), ())
_MF = NodalSeries((1.0429, 0.4135, -0.0040), (-23.74, 2.68, -0.38))


@dataclass(frozen=True, slots=True)
class Constituent:
    """One harmonic constituent.

    Attributes:
        name: as the International Hydrographic Organization writes it: M2, K1...
        doodson: multiples of the mean lunar time, of the mean longitudes of Moon, Sun and lunar perigee, of the
            negated longitude of the lunar node and of the longitude of the solar perigee.
        phase_deg: what is added to them to make V.
        series: of the nodal corrections; in shallow water several, whose f multiply and whose u add up.
    """

    name: str
    doodson: DoodsonNumbers
    phase_deg: float = 0.0
    series: tuple[NodalSeries, ...] = ()

    @property
    def frequency_radps(self) -> float:
        """Angular speed."""
        moon, sun, perigee, node, solar_perigee = (
            rate / _CENTURY_S for _, rate in (_MOON, _SUN, _LUNAR_PERIGEE, _LUNAR_NODE, _SOLAR_PERIGEE)
        )
        lunar_time = 360 / _DAY_S + sun - moon
        return radians(self._sum((lunar_time, moon, sun, perigee, -node, solar_perigee)))

    @property
    def period_s(self) -> float:
        """Time of one turn."""
        return tau / self.frequency_radps

    def argument_rad(self, time_s: float) -> float:
        """V, the phase at Greenwich at a unix time."""
        moon, sun, perigee, node, solar_perigee = (
            _longitude_deg(body, time_s) for body in (_MOON, _SUN, _LUNAR_PERIGEE, _LUNAR_NODE, _SOLAR_PERIGEE)
        )
        lunar_time = 360 * (time_s % _DAY_S) / _DAY_S + sun - moon
        turned = self._sum((lunar_time, moon, sun, perigee, -node, solar_perigee))
        return radians((turned + self.phase_deg) % 360)

    def nodal(self, time_s: float) -> tuple[float, float]:
        """f and u (rad), at a unix time; 1 and 0 of what the Sun alone makes."""
        node = radians(_longitude_deg(_LUNAR_NODE, time_s))
        factor, angle = 1.0, 0.0
        for series in self.series:
            f, u = series.at(node)
            factor, angle = factor * f, angle + u
        return factor, angle

    def _sum(self, angles: tuple[float, ...]) -> float:
        return sum(multiple * angle for multiple, angle in zip(self.doodson, angles, strict=True))


def _longitude_deg(body: tuple[float, float], time_s: float) -> float:
    at_epoch, rate = body
    return at_epoch + rate * (time_s - J2000_UNIX_S) / _CENTURY_S


_KNOWN = (
    # twice a day
    Constituent("M2", (2, 0, 0, 0, 0, 0), 0, (_M2,)),
    Constituent("S2", (2, 2, -2, 0, 0, 0)),
    Constituent("N2", (2, -1, 0, 1, 0, 0), 0, (_M2,)),
    Constituent("K2", (2, 2, 0, 0, 0, 0), 0, (_K2,)),
    Constituent("2N2", (2, -2, 0, 2, 0, 0), 0, (_M2,)),
    Constituent("MU2", (2, -2, 2, 0, 0, 0), 0, (_M2,)),
    Constituent("NU2", (2, -1, 2, -1, 0, 0), 0, (_M2,)),
    Constituent("LAMBDA2", (2, 1, -2, 1, 0, 0), 180, (_M2,)),
    Constituent("T2", (2, 2, -3, 0, 0, 1)),
    # once a day
    Constituent("K1", (1, 1, 0, 0, 0, 0), 90, (_K1,)),
    Constituent("O1", (1, -1, 0, 0, 0, 0), -90, (_O1,)),
    Constituent("P1", (1, 1, -2, 0, 0, 0), -90),
    Constituent("Q1", (1, -2, 0, 1, 0, 0), -90, (_O1,)),
    Constituent("RHO1", (1, -2, 2, -1, 0, 0), -90, (_O1,)),
    Constituent("J1", (1, 2, 0, -1, 0, 0), 90, (_J1,)),
    Constituent("OO1", (1, 3, 0, 0, 0, 0), 90, (_OO1,)),
    # long periods
    Constituent("MF", (0, 2, 0, 0, 0, 0), 0, (_MF,)),
    Constituent("MM", (0, 1, 0, -1, 0, 0), 0, (_MM,)),
    Constituent("SSA", (0, 0, 2, 0, 0, 0)),
    # shallow water
    Constituent("MK3", (3, 1, 0, 0, 0, 0), 90, (_M2, _K1)),
    Constituent("M4", (4, 0, 0, 0, 0, 0), 0, (_M2, _M2)),
    Constituent("MS4", (4, 2, -2, 0, 0, 0), 0, (_M2,)),
    Constituent("MN4", (4, -1, 0, 1, 0, 0), 0, (_M2, _M2)),
    Constituent("S4", (4, 4, -4, 0, 0, 0)),
    Constituent("M6", (6, 0, 0, 0, 0, 0), 0, (_M2, _M2, _M2)),
)

CONSTITUENTS: Mapping[str, Constituent] = MappingProxyType({each.name: each for each in _KNOWN})


def constituent(name: str) -> Constituent:
    """The constituent of that name, in capitals or not.

    Raises:
        ValueError: not a name that is known here.
    """
    found = CONSTITUENTS.get(name.upper())
    if found is None:
        raise ValueError(f"tidal constituent {name!r}: want one of {', '.join(CONSTITUENTS)}")
    return found
