"""Latitude and longitude to metres north and east of an origin, and back: one frame for positions and forecasts."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, isfinite, nan, pi, radians, sin, sqrt

# WGS 84
EQUATORIAL_RADIUS_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
_SQUEEZE = (1 - FLATTENING) ** 2  # 1 - e^2: square of the polar over the equatorial radius


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """The plane that touches the WGS 84 ellipsoid at an origin, with places moved onto it along its normal.

    An orthographic projection: exact both ways, at the poles and across the date line, too. Distances from the origin
    come out short by d^3 / 6 R^2: 4 mm at 10 km, 4 m at 100 km. North is the origin's: at d to the east of it true
    north is off by d tan(latitude) / R, which is 0.16 degrees at 10 km and 60 degrees of latitude.

    Attributes:
        latitude_rad, longitude_rad: of the origin, geodetic; the longitude in any number of turns.

    Raises:
        ValueError: a latitude beyond a pole, or an angle that is not finite.
    """

    latitude_rad: float
    longitude_rad: float

    def __post_init__(self) -> None:
        if not abs(self.latitude_rad) <= pi / 2:
            raise ValueError(f"latitude_rad = {self.latitude_rad!r}: want an angle from -pi/2 to pi/2")
        if not isfinite(self.longitude_rad):
            raise ValueError(f"longitude_rad = {self.longitude_rad!r}: want a finite angle")

    @classmethod
    def at_degrees(cls, latitude_deg: float, longitude_deg: float) -> LocalFrame:
        """The frame of an origin in degrees."""
        return cls(radians(latitude_deg), radians(longitude_deg))

    def metres(self, latitude_rad: float, longitude_rad: float) -> tuple[float, float]:
        """North and east of the origin; NaN for a place a quarter round the Earth away, or farther."""
        turn = longitude_rad - self.longitude_rad
        sine, cosine = sin(self.latitude_rad), cos(self.latitude_rad)
        if not sin(latitude_rad) * sine + cos(latitude_rad) * cos(turn) * cosine > 0:
            return nan, nan
        radius = _prime_vertical_m(latitude_rad)
        out = radius * cos(latitude_rad) * cos(turn) - _prime_vertical_m(self.latitude_rad) * cosine
        up = (radius * sin(latitude_rad) - _prime_vertical_m(self.latitude_rad) * sine) * _SQUEEZE
        return up * cosine - out * sine, radius * cos(latitude_rad) * sin(turn)

    def degrees(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude, and longitude from -180 to 180, of a place; NaN for one beside the Earth."""
        sine, cosine = sin(self.latitude_rad), cos(self.latitude_rad)
        radius = _prime_vertical_m(self.latitude_rad)
        # the line through the place, along the normal of the plane, meets the ellipsoid where a h^2 + 2 b h + c = 0
        a = cosine**2 + sine**2 / _SQUEEZE
        b = radius + north_m * sine * cosine * (1 / _SQUEEZE - 1)
        c = north_m**2 * (sine**2 + cosine**2 / _SQUEEZE) + east_m**2
        if not b**2 >= a * c:
            return nan, nan
        height = -c / (b + sqrt(b**2 - a * c))
        out = radius * cosine - north_m * sine + height * cosine
        up = radius * sine * _SQUEEZE + north_m * cosine + height * sine
        longitude_deg = degrees(self.longitude_rad + atan2(east_m, out))
        return degrees(atan2(up / _SQUEEZE, hypot(out, east_m))), (longitude_deg + 180) % 360 - 180


def _prime_vertical_m(latitude_rad: float) -> float:
    """Radius of curvature across the meridian."""
    return EQUATORIAL_RADIUS_M / sqrt(1 - (1 - _SQUEEZE) * sin(latitude_rad) ** 2)
