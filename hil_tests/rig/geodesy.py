"""Where on earth the simulated vehicle is: a tangent plane in the Trondheimsfjord, on the ellipsoid WGS 84."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt, tan

ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG = 63.4600, 10.3800
ORIGIN_LATITUDE_RAD = radians(ORIGIN_LATITUDE_DEG)

SEMI_MAJOR_AXIS_M, ECCENTRICITY_SQUARED = 6_378_137.0, 6.69437999014e-3
FLATTENED = 1.0 - ECCENTRICITY_SQUARED * sin(ORIGIN_LATITUDE_RAD) ** 2
NORTH_RADIUS_M = SEMI_MAJOR_AXIS_M * (1.0 - ECCENTRICITY_SQUARED) / FLATTENED**1.5
EAST_RADIUS_M = SEMI_MAJOR_AXIS_M / sqrt(FLATTENED)
METRES_PER_DEGREE_NORTH = NORTH_RADIUS_M * pi / 180.0
METRES_PER_DEGREE_EAST = EAST_RADIUS_M * cos(ORIGIN_LATITUDE_RAD) * pi / 180.0

EARTH_RATE_RADPS = 7.292115e-5
EARTH_RATE_NED_RADPS = (
    EARTH_RATE_RADPS * cos(ORIGIN_LATITUDE_RAD),
    0.0,
    -EARTH_RATE_RADPS * sin(ORIGIN_LATITUDE_RAD),
)
# Normal gravity on the ellipsoid (Somigliana). It grows with depth: by 3.086e-6 per second squared for a point that
# comes nearer to the earth's centre, less 4 pi G rho for the water that is above it then.
SURFACE_GRAVITY_MPS2 = 9.7803253359 * (1.0 + 1.931852652e-3 * sin(ORIGIN_LATITUDE_RAD) ** 2) / sqrt(FLATTENED)
GRAVITY_GROWTH_PER_S2 = 3.086e-6 - 4.0 * pi * 6.674e-11 * 1025.0


def degrees_e7(north_m: float, east_m: float) -> tuple[int, int]:
    """Latitude and longitude in MAVLink's unit, 1e-7 degree."""
    latitude_deg = ORIGIN_LATITUDE_DEG + north_m / METRES_PER_DEGREE_NORTH
    longitude_deg = ORIGIN_LONGITUDE_DEG + east_m / METRES_PER_DEGREE_EAST
    return round(1e7 * latitude_deg), round(1e7 * longitude_deg)


def place_m(latitude_rad: float, longitude_rad: float) -> tuple[float, float]:
    """Metres north and east of the origin, of a place near it."""
    north_m = NORTH_RADIUS_M * (latitude_rad - ORIGIN_LATITUDE_RAD)
    return north_m, EAST_RADIUS_M * cos(ORIGIN_LATITUDE_RAD) * (longitude_rad - radians(ORIGIN_LONGITUDE_DEG))


def gravity_mps2(depth_m: float) -> float:
    """Downwards, below the surface of the fjord."""
    return SURFACE_GRAVITY_MPS2 + GRAVITY_GROWTH_PER_S2 * depth_m


def transport_rate_radps(north_mps: float, east_mps: float) -> tuple[float, float, float]:
    """How a level, north-pointing frame turns that moves over the earth, about its north, east and down axis."""
    east_part = east_mps / EAST_RADIUS_M
    return east_part, -north_mps / NORTH_RADIUS_M, -east_part * tan(ORIGIN_LATITUDE_RAD)
