"""The earth as an inertial navigation system sees it: the ellipsoid WGS 84, its rotation and its gravity."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt, tan

from detectors.navigation.sample import Vector

# WGS 84 (NGA.STND.0036, tables 3.1 to 3.7)
SEMI_MAJOR_AXIS_M = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
ROTATION_RADPS = 7.292115e-5
EQUATOR_GRAVITY_MPS2 = 9.7803253359
POLE_GRAVITY_MPS2 = 9.8321849379

_SOMIGLIANA = (1.0 - FLATTENING) * POLE_GRAVITY_MPS2 / EQUATOR_GRAVITY_MPS2 - 1.0
_CENTRIFUGAL = ROTATION_RADPS**2 * SEMI_MAJOR_AXIS_M / EQUATOR_GRAVITY_MPS2  # near the book's m, ample for a gradient
_POLE_COSINE = 1e-6  # of the latitude 6 m from a pole
_GRAVITATION_M3PKGPS2 = 6.6743e-11
_SEA_WATER_KGPM3 = 1025.0
# What a level sheet of water pulls downwards while it is below, it pulls upwards when it is above: 2 pi G rho, twice.
WATER_GRADIENT_PS2 = 4.0 * pi * _GRAVITATION_M3PKGPS2 * _SEA_WATER_KGPM3


def curvature_radii_m(latitude_rad: float) -> tuple[float, float]:
    """Radii of curvature of the ellipsoid along the meridian and across it (the prime vertical)."""
    squeezed = 1.0 - ECCENTRICITY_SQUARED * sin(latitude_rad) ** 2
    transverse_m = SEMI_MAJOR_AXIS_M / sqrt(squeezed)
    return transverse_m * (1.0 - ECCENTRICITY_SQUARED) / squeezed, transverse_m


def gravity_mps2(latitude_rad: float, depth_m: float) -> float:
    """Gravity below the surface of the sea: Somigliana's normal gravity, and more of it the deeper.

    Heights above the sea are negative depths; the gradient of the water is used for them as well, for a vehicle on
    deck or on the crane.
    """
    sine_squared = sin(latitude_rad) ** 2
    surface = (
        EQUATOR_GRAVITY_MPS2 * (1.0 + _SOMIGLIANA * sine_squared) / sqrt(1.0 - ECCENTRICITY_SQUARED * sine_squared)
    )
    return surface + gravity_gradient_ps2(latitude_rad) * depth_m


def gravity_gradient_ps2(latitude_rad: float) -> float:
    """How fast gravity grows with depth in sea water: the free-air gradient, linear in height (Hofmann-Wellenhof and
    Moritz, Physical Geodesy, equation 2-215), less the water's own mass. About 2.2e-6 m/s2 per metre."""
    sine_squared = sin(latitude_rad) ** 2
    flattened = 1.0 + FLATTENING + _CENTRIFUGAL - 2.0 * FLATTENING * sine_squared
    return 2.0 * EQUATOR_GRAVITY_MPS2 * flattened / SEMI_MAJOR_AXIS_M - WATER_GRADIENT_PS2


def earth_rate_radps(latitude_rad: float) -> Vector:
    """(3,) rotation of the earth, north, east, down."""
    return ROTATION_RADPS * cos(latitude_rad), 0.0, -ROTATION_RADPS * sin(latitude_rad)


def transport_rate_radps(velocity_mps: Vector, latitude_rad: float, depth_m: float) -> Vector:
    """(3,) rotation of the frame north-east-down as it is carried over the curved earth.

    Args:
        velocity_mps: (3,) north, east, down.
        latitude_rad: not at a pole, where there is no north.
        depth_m: below the ellipsoid.
    """
    return LocalEarth.at(latitude_rad).transport_rate_radps(velocity_mps, depth_m)


@dataclass(frozen=True, slots=True)
class LocalEarth:
    """What of the above depends on the latitude, for use at many depths and velocities.

    Attributes:
        meridian_m, transverse_m: radii of curvature on the ellipsoid.
        cosine, tangent: of the latitude.
        earth_rate_radps: (3,) north, east, down.
        surface_gravity_mps2, gravity_gradient_ps2: gravity at depth 0, and its growth.
    """

    meridian_m: float
    transverse_m: float
    cosine: float
    tangent: float
    earth_rate_radps: Vector
    surface_gravity_mps2: float
    gravity_gradient_ps2: float

    @classmethod
    def at(cls, latitude_rad: float) -> LocalEarth:
        """Of a latitude. Nearer to a pole than 6 m, north turns faster than vehicles do: taken as there."""
        return cls(
            *curvature_radii_m(latitude_rad),
            max(cos(latitude_rad), _POLE_COSINE),
            min(max(tan(latitude_rad), -1.0 / _POLE_COSINE), 1.0 / _POLE_COSINE),
            earth_rate_radps(latitude_rad),
            gravity_mps2(latitude_rad, 0.0),
            gravity_gradient_ps2(latitude_rad),
        )

    def transport_rate_radps(self, velocity_mps: Vector, depth_m: float) -> Vector:
        """(3,) as the function of this name."""
        north, east, _ = velocity_mps
        about_north = east / (self.transverse_m - depth_m)
        return about_north, -north / (self.meridian_m - depth_m), -about_north * self.tangent
