"""Where on earth the simulated vehicle is: a tangent plane in the Trondheimsfjord."""

from __future__ import annotations

from math import cos, radians

ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG = 63.4600, 10.3800
METRES_PER_DEGREE = 111_320.0
LONGITUDE_SHRINK = cos(radians(ORIGIN_LATITUDE_DEG))


def degrees_e7(north_m: float, east_m: float) -> tuple[int, int]:
    """Latitude and longitude in MAVLink's unit, 1e-7 degree."""
    latitude_deg = ORIGIN_LATITUDE_DEG + north_m / METRES_PER_DEGREE
    longitude_deg = ORIGIN_LONGITUDE_DEG + east_m / (METRES_PER_DEGREE * LONGITUDE_SHRINK)
    return round(1e7 * latitude_deg), round(1e7 * longitude_deg)
