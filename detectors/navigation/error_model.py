"""How the errors of a strapdown system grow: process model of the error-state Kalman filter (paper 003, equation 4).

The sixteen states are the paper's, in north-east-down instead of its east-north-up, in this order: attitude,
velocity, position, accelerometer bias, gyroscope bias, depth sensor. Each is the true value minus the one in use, so
that a correction adds it:

- attitude: the rotation vector phi in north-east-down with C_true = (I + [phi x]) C;
- position: in metres north, east and down. The paper has radians of latitude and longitude; beside metres of depth
  those make variances of 1e-13 and 1, and a covariance matrix that loses its digits;
- biases: in the body;
- depth sensor: metres that it reads too deep.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.rotation import matrix
from detectors.navigation.sample import Vector
from detectors.navigation.strapdown import Strapdown, StrapdownError

FloatArray = NDArray[np.float64]

ATTITUDE = slice(0, 3)
VELOCITY = slice(3, 6)
POSITION = slice(6, 9)
ACCELEROMETER_BIAS = slice(9, 12)
GYROSCOPE_BIAS = slice(12, 15)
DEPTH_SENSOR = 15
STATES = 16

# Random walks of the biases. A VN-100's in-run stability (data sheet: 0.04 mg, 10 degrees per hour; reached in five
# minutes) would be a quarter of the first and a seventh of the second: they also stand for what a bias cannot, scale
# errors and vibration.
ACCELEROMETER_BIAS_WALK = 1e-4  # m/s2 per root second
GYROSCOPE_BIAS_WALK = 2e-5  # rad/s per root second
# What a depth sensor is off by and keeps for a while: density of the water, air pressure, swell. A first-order
# Gauss-Markov process, so that its uncertainty stays bounded.
DEPTH_SENSOR_ERROR_M = 0.1
DEPTH_SENSOR_TIME_S = 600.0


def error_dynamics(strapdown: Strapdown, specific_force_mps2: Vector, states: int = STATES) -> FloatArray:
    """F: the errors' rates of change by the errors, in continuous time.

    Args:
        strapdown: where, how fast and in what attitude.
        specific_force_mps2: (3,) north, east, down, without bias; over longer steps than a sample, the mean.
        states: how many there are in all: those behind the sixteen are constants, and nothing depends on them here.

    Returns:
        (states, states).
    """
    dynamics = np.zeros((states, states))
    earth = strapdown.earth
    meridian_m, transverse_m = earth.meridian_m - strapdown.depth_m, earth.transverse_m - strapdown.depth_m
    cosines = matrix(strapdown.attitude)
    earth_rate = np.array(earth.earth_rate_radps)
    transport = np.array(earth.transport_rate_radps(strapdown.velocity_mps, strapdown.depth_m))
    by_velocity = _transport_by_velocity(meridian_m, transverse_m, earth.tangent)
    earth_by_position, transport_by_position = _rates_by_position(strapdown, meridian_m, transverse_m)

    # phi' = -w_in x phi - C b_gyro - dw_in
    dynamics[ATTITUDE, ATTITUDE] = -_skew(earth_rate + transport)
    dynamics[ATTITUDE, VELOCITY] = -by_velocity
    dynamics[ATTITUDE, POSITION] = -earth_by_position - transport_by_position
    dynamics[ATTITUDE, GYROSCOPE_BIAS] = -cosines
    # dv' = phi x f - C b_acc - (2 w_ie + w_en) x dv + v x (2 dw_ie + dw_en) + dg
    moving = _skew(np.array(strapdown.velocity_mps))
    dynamics[VELOCITY, ATTITUDE] = -_skew(np.array(specific_force_mps2))
    dynamics[VELOCITY, VELOCITY] = moving @ by_velocity - _skew(2.0 * earth_rate + transport)
    dynamics[VELOCITY, POSITION] = moving @ (2.0 * earth_by_position + transport_by_position)
    dynamics[VELOCITY.stop - 1, POSITION.stop - 1] += earth.gravity_gradient_ps2
    dynamics[VELOCITY, ACCELEROMETER_BIAS] = -cosines
    # dp' = dv, and what a metre is changes on the way
    dynamics[POSITION, VELOCITY] = np.eye(3)
    dynamics[POSITION, POSITION] = _position_by_position(strapdown, meridian_m, transverse_m)
    dynamics[DEPTH_SENSOR, DEPTH_SENSOR] = -1.0 / DEPTH_SENSOR_TIME_S
    return dynamics


def process_noise(config: NavigationConfig, states: int = STATES) -> FloatArray:
    """Q: spectral densities of the noise that drives the errors, (states, states), diagonal.

    An IMU's noise is the same along all axes, so that no attitude turns it.
    """
    density = np.zeros(states)
    density[ATTITUDE] = config.gyroscope_noise_radps**2
    density[VELOCITY] = config.accelerometer_noise_mps2**2
    density[ACCELEROMETER_BIAS] = ACCELEROMETER_BIAS_WALK**2
    density[GYROSCOPE_BIAS] = GYROSCOPE_BIAS_WALK**2
    density[DEPTH_SENSOR] = 2.0 * DEPTH_SENSOR_ERROR_M**2 / DEPTH_SENSOR_TIME_S
    return np.diag(density)


def initial_covariance(config: NavigationConfig, states: int = STATES) -> FloatArray:
    """P at the start, (states, states), diagonal; those behind the sixteen are left at 0."""
    deviation = np.zeros(states)
    deviation[ATTITUDE] = config.attitude_error_rad, config.attitude_error_rad, config.heading_error_rad
    deviation[VELOCITY] = config.velocity_error_mps
    deviation[POSITION] = config.position_error_m
    deviation[ACCELEROMETER_BIAS] = config.accelerometer_bias_mps2
    deviation[GYROSCOPE_BIAS] = config.gyroscope_bias_radps
    deviation[DEPTH_SENSOR] = DEPTH_SENSOR_ERROR_M
    return np.diag(deviation**2)


def transition(dynamics: FloatArray, noise: FloatArray, interval_s: float) -> tuple[FloatArray, FloatArray]:
    """Phi and Q of one step, both to the second order in the interval.

    Args:
        dynamics: F, (n, n).
        noise: Q as spectral densities, (n, n).
        interval_s: of the step; well below the Schuler period, a second or less.

    Returns:
        The transition matrix I + F t + F F t t / 2, and the covariance (Phi Q Phi' + Q) t / 2 of what comes to it:
        the trapezoid, which, unlike a cut series, has no negative variance in any direction. Both (n, n).
    """
    step = dynamics * interval_s
    phi = np.eye(len(step)) + step + 0.5 * (step @ step)
    passed_on = phi @ noise @ phi.T
    return phi, 0.25 * interval_s * (passed_on + passed_on.T + 2.0 * noise)


def strapdown_error(states: FloatArray) -> StrapdownError:
    """What `Strapdown.correct` takes, from estimated states (16 or more,)."""
    return StrapdownError(
        attitude_rad=_vector(states[ATTITUDE]),
        velocity_mps=_vector(states[VELOCITY]),
        position_m=_vector(states[POSITION]),
        accelerometer_bias_mps2=_vector(states[ACCELEROMETER_BIAS]),
        gyroscope_bias_radps=_vector(states[GYROSCOPE_BIAS]),
    )


def _transport_by_velocity(meridian_m: float, transverse_m: float, tangent: float) -> FloatArray:
    """(3, 3) Derivatives of the transport rate by the velocity."""
    return np.array(
        ((0.0, 1.0 / transverse_m, 0.0), (-1.0 / meridian_m, 0.0, 0.0), (0.0, -tangent / transverse_m, 0.0))
    )


def _rates_by_position(strapdown: Strapdown, meridian_m: float, transverse_m: float) -> tuple[FloatArray, FloatArray]:
    """(3, 3) each: derivatives of the earth's rate and of the transport rate by metres north, east and down.

    That the radii themselves change with the latitude is left out: a hundredth of the smallest of these terms. So is
    gravity's change with latitude: 8e-9 m/s2 per metre.
    """
    earth, (north_mps, east_mps, _) = strapdown.earth, strapdown.velocity_mps
    earth_north, _, earth_down = earth.earth_rate_radps
    earth_by_position, transport_by_position = np.zeros((2, 3, 3))
    earth_by_position[0, 0], earth_by_position[2, 0] = earth_down / meridian_m, -earth_north / meridian_m
    transport_by_position[2, 0] = -east_mps * (1.0 + earth.tangent**2) / (transverse_m * meridian_m)
    transport_by_position[:, 2] = (
        east_mps / transverse_m**2,
        -north_mps / meridian_m**2,
        -east_mps * earth.tangent / transverse_m**2,
    )
    return earth_by_position, transport_by_position


def _position_by_position(strapdown: Strapdown, meridian_m: float, transverse_m: float) -> FloatArray:
    """(3, 3) Metres north and east are angles times radii: the angles' rates depend on latitude and depth, and the
    radii change with the vehicle's own motion."""
    north_mps, east_mps, down_mps = strapdown.velocity_mps
    tangent = strapdown.earth.tangent
    shrinking = -down_mps / transverse_m - north_mps * tangent / meridian_m
    return np.array(
        (
            (-down_mps / meridian_m, 0.0, north_mps / meridian_m),
            (east_mps * tangent / meridian_m, shrinking, east_mps / transverse_m),
            (0.0, 0.0, 0.0),
        )
    )


def _skew(vector: FloatArray) -> FloatArray:
    """(3, 3) The matrix of vector x."""
    x, y, z = vector
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def _vector(array: FloatArray) -> Vector:
    x, y, z = array.tolist()
    return x, y, z
