"""What DVL, depth sensor, fixes and another system's heading measure, by the filter's states.

Each function compares a sample with what is expected of it: innovation, its derivatives by the states (the paper's
observation matrix, equation 5), and the noise of a healthy sensor, which grows with how hard the vehicle manoeuvres.
"""

from __future__ import annotations

from math import atan2, cos, hypot, pi, remainder
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import ATTITUDE, DEPTH_SENSOR, GYROSCOPE_BIAS, POSITION, VELOCITY
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_ARM,
    DEPTH_DELAY,
    DVL_DELAY,
    LEVER_ARM,
    MOUNTING,
    SCALE,
)
from detectors.navigation.motion import BodyMotion
from detectors.navigation.rotation import matrix
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample
from detectors.navigation.strapdown import Strapdown

FloatArray = NDArray[np.float64]

# What the model of the mounting leaves over, as noise per unit of turn rate and acceleration: fitted on AUV Snapir.
DVL_TURN_M = 0.08
DVL_CHANGE_S = 0.06
DEPTH_CHANGE_S = 0.15
DEPTH_TURN_M = 0.5
# An unknown delay longer than this makes the turn rate of then another one than that of now; and the arm's first
# guess errs by about so much.
LASTING_S, UNKNOWN_ARM_M = 0.2, 1.0
WOBBLE_RADPS = 0.05  # of a hull on a straight course: the arm's own uncertainty covers what it does to that
# That noise lasts: more samples of the same second say no more.
ROUGH_S = 1.0
_DOWN = POSITION.stop - 1


class Comparison(NamedTuple):
    """A sample beside what is expected of it.

    Attributes:
        innovation: (M,) measured minus expected.
        observation: (M, N) H, derivatives of the expected by the N states.
        noise: (M, M) R, covariance of the measurement's own noise.
    """

    innovation: FloatArray
    observation: FloatArray
    noise: FloatArray


class Moment(NamedTuple):
    """The state of things that a sample is compared with.

    Attributes:
        strapdown, motion: of the vehicle.
        constants: (N,) the estimated values of what is constant, in the places of their states; others are 0.
        ahead_s: how much later than these the sample was measured; a fraction of the IMU's interval.
        interval_s: since the sample of this sensor before.
        caution: factor of the noise in turns, 1 or more, while the mounting is not known yet.
        unsteady_radps, unsteady_mps2: how far turn rate and acceleration, within the time that a delay is uncertain
            by, are from what they are at this moment.
        dvl_delay_error_s, depth_delay_error_s: standard deviations of the delays.
    """

    strapdown: Strapdown
    motion: BodyMotion
    constants: FloatArray
    ahead_s: float = 0.0
    interval_s: float = 1.0
    caution: float = 1.0
    unsteady_radps: float = 0.0
    unsteady_mps2: float = 0.0
    dvl_delay_error_s: float = 0.0
    depth_delay_error_s: float = 0.0


def compare_dvl(sample: DvlSample, moment: Moment, noise_mps: FloatArray) -> Comparison:
    """Velocity over ground at the DVL's place and instant, along its axes: (1 + s) M' (C' v + w x l).

    Args:
        sample: of the DVL.
        moment: that it is compared with.
        noise_mps: (3,) standard deviations while driving straight on.
    """
    strapdown, constants = moment.strapdown, moment.constants
    to_body = matrix(strapdown.attitude).T
    velocity = np.array(strapdown.velocity_mps)
    rate, change = np.array(moment.motion.rate_radps), np.array(moment.motion.acceleration_mps2)
    arm = constants[LEVER_ARM]
    at_place = to_body @ velocity + _cross(rate, arm) + change * moment.ahead_s
    to_dvl = (1.0 + constants[SCALE]) * (np.eye(3) - _skew(constants[MOUNTING]))
    observation = np.zeros((3, ALL_STATES))
    observation[:, ATTITUDE] = to_dvl @ to_body @ _skew(velocity)
    observation[:, VELOCITY] = to_dvl @ to_body
    observation[:, GYROSCOPE_BIAS] = to_dvl @ _skew(arm)
    observation[:, LEVER_ARM] = to_dvl @ _skew(rate)
    observation[:, MOUNTING] = _skew(at_place)
    observation[:, SCALE] = at_place
    observation[:, DVL_DELAY] = -change
    # what an unknown delay does to a motion that changes meanwhile is not in its derivative
    late_s = moment.dvl_delay_error_s
    swung_radps = min(1.0, late_s / LASTING_S) * moment.unsteady_radps
    turned_mps = swung_radps * float(np.linalg.norm(arm)) + max(swung_radps - WOBBLE_RADPS, 0.0) * UNKNOWN_ARM_M
    unknown = (late_s * moment.unsteady_mps2 + turned_mps) ** 2
    rough = unknown + moment.caution**2 * (DVL_TURN_M**2 * (rate @ rate) + DVL_CHANGE_S**2 * (change @ change))
    rough *= _repeated(moment)
    return Comparison(np.array(sample.velocity_mps) - to_dvl @ at_place, observation, np.diag(noise_mps**2 + rough))


def compare_depth(sample: DepthSample, moment: Moment, noise_m: float) -> Comparison:
    """Depth at the sensor's place and instant, and the sensor's own error."""
    strapdown, constants = moment.strapdown, moment.constants
    bow_north, bow_east, bow_down = matrix(strapdown.attitude)[:, 0]
    sinking, arm = strapdown.velocity_mps[2], constants[DEPTH_ARM]
    expected = strapdown.depth_m + sinking * moment.ahead_s + constants[DEPTH_SENSOR] + bow_down * arm
    observation = np.zeros((1, ALL_STATES))
    observation[0, ATTITUDE] = bow_east * arm, -bow_north * arm, 0.0
    observation[0, _DOWN] = 1.0
    observation[0, DEPTH_SENSOR] = 1.0
    observation[0, DEPTH_ARM] = bow_down
    observation[0, DEPTH_DELAY] = -sinking
    unknown = (moment.depth_delay_error_s**2 * moment.unsteady_mps2) ** 2
    rough = unknown + (DEPTH_CHANGE_S * sinking) ** 2 + (DEPTH_TURN_M * moment.motion.rate_radps[1]) ** 2
    rough *= _repeated(moment)
    return Comparison(np.array([sample.depth_m - expected]), observation, np.array([[noise_m**2 + rough]]))


def compare_fix(sample: FixSample, moment: Moment, noise_m: float) -> Comparison:
    """Metres north and east."""
    strapdown = moment.strapdown
    earth = strapdown.earth
    north_m = (sample.latitude_rad - strapdown.latitude_rad) * (earth.meridian_m - strapdown.depth_m)
    east_rad = remainder(sample.longitude_rad - strapdown.longitude_rad, 2.0 * pi)
    east_m = east_rad * (earth.transverse_m - strapdown.depth_m) * cos(strapdown.latitude_rad)
    observation = np.zeros((2, ALL_STATES))
    observation[:, POSITION.start : _DOWN] = np.eye(2)
    return Comparison(np.array([north_m, east_m]), observation, noise_m**2 * np.eye(2))


def compare_heading(sample: AttitudeSample, moment: Moment, noise_rad: float) -> Comparison:
    """The heading: how the horizontal part of the bow turns with the attitude's error."""
    north, east, down = matrix(moment.strapdown.attitude)[:, 0]
    level = max(hypot(north, east), 0.1)  # straight up there is no heading: then it says nearly nothing
    observation = np.zeros((1, ALL_STATES))
    observation[0, ATTITUDE] = -down * north / level**2, -down * east / level**2, 1.0
    off_rad = remainder(sample.attitude_rad[2] - atan2(east, north), 2.0 * pi)
    return Comparison(np.array([off_rad]), observation, np.array([[(noise_rad / level) ** 2]]))


def _repeated(moment: Moment) -> float:
    """How many samples say the same of what lasts."""
    return max(1.0, ROUGH_S / max(moment.interval_s, 0.02))


def _skew(vector: FloatArray) -> FloatArray:
    x, y, z = vector
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def _cross(left: FloatArray, right: FloatArray) -> FloatArray:
    return _skew(left) @ right
