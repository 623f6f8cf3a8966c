"""How the sensors are mounted: ten constants behind the paper's sixteen states, learnt while driving.

On real vehicles these, not the sensors, make most of the innovations in turns: on AUV Snapir the DVL's stamps are
half a second ahead of the IMU's, and the depth is that of a place 1.5 m ahead of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import STATES

FloatArray = NDArray[np.float64]

LEVER_ARM = slice(STATES, STATES + 3)  # m, from the IMU to the DVL
MOUNTING = slice(STATES + 3, STATES + 6)  # rad, small rotation vector from the body's axes to the DVL's
SCALE = STATES + 6  # relative: the DVL measures 1 + scale times the velocity
DVL_DELAY = STATES + 7  # s, by which the DVL's samples are stamped later than what they measured
DEPTH_DELAY = STATES + 8  # s, the same of the depth sensor
DEPTH_ARM = STATES + 9  # m, from the IMU forward to the depth sensor
ALL_STATES = STATES + 10

INSTALLED = slice(STATES, ALL_STATES)
# Standard deviations of first guesses: sensors are within a vehicle of some metres, and screwed on about straight.
_DEVIATIONS = np.array([1.0, 1.0, 1.0, 0.03, 0.03, 0.03, 0.01, 0.7, 0.5, 1.5])
# Standard deviations by which they wander in a second, so that what was learnt can still be mended. Delays do wander:
# clocks drift apart (in the recordings of AUV Snapir by a second in 400 s).
_WALKS = np.array([1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6, 1e-6, 1.5e-2, 1.5e-2, 1e-4])


@dataclass(frozen=True, slots=True, eq=False)
class Installation:
    """What is known of the mounting.

    Attributes:
        values: (10,) in the order of the states above.
        covariance: (10, 10) of their errors.
    """

    values: FloatArray
    covariance: FloatArray

    @staticmethod
    def of(config: NavigationConfig) -> Installation:
        """The configuration's first guess; or, where that is not to be changed, its last word."""
        values = np.array([*config.dvl_lever_arm_m, *config.dvl_mounting_rad, 0.0, config.dvl_delay_s, 0.0, 0.0])
        deviations = _DEVIATIONS * config.estimate_installation
        return Installation(values, np.diag(deviations**2))


def installation_noise(config: NavigationConfig) -> FloatArray:
    """(10,) spectral densities of the random walks."""
    return np.asarray(_WALKS**2 * config.estimate_installation)
