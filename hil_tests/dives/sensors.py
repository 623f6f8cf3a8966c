"""What the sensors of a dive say of its motion: noise, offsets, wrong places, angles and instants.

The inertial sensors are of the class of a VN-100 (VectorNav's data sheet), on a hull that its thrusters shake.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from hil_tests.dives.motion import Motion

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]

IMU_HZ = 100.0
DVL_RATES_HZ = (1.0, 2.0, 5.0, 10.0)
DEPTH_RATES_HZ = (1.0, 2.0, 5.0, 10.0)

# VN-100: noise densities, in-run bias stabilities (as the deviation of a bias that wanders), both generously.
ACCELEROMETER_DENSITY = 1.4e-3  # m/s2 a square root of Hz
GYROSCOPE_DENSITY = 6.1e-5  # rad/s a square root of Hz
ACCELEROMETER_WANDER_MPS2 = 4e-4
GYROSCOPE_WANDER_RADPS = 3e-5
WANDER_S = (100.0, 1000.0)
ACCELEROMETER_OFFSET_MPS2 = 0.03  # since it was switched on
GYROSCOPE_OFFSET_RADPS = 1e-3
SENSITIVITY = 1e-3  # relative error
VIBRATION_MPS2 = (0.0, 0.04)  # of a sample
VIBRATION_RADPS = (0.0, 1.5e-3)

DVL_NOISE_MPS = (0.003, 0.01)
DVL_NOISE = (0.002, 0.01)  # relative to the speed
DVL_VERTICAL = 0.4  # its noise, relative: the beams point down
DVL_MOUNTING_RAD = (0.0, np.deg2rad(3.0))
DVL_SCALE = (-0.01, 0.01)
DVL_DELAY_S = (-0.8, 1.5)
DEPTH_NOISE_M = (0.005, 0.05)
DEPTH_OFFSET_M = 0.2
DEPTH_DELAY_S = (0.0, 0.5)

# Of rough dives: loss of bottom lock, single wrong samples, lost messages.
GAPS_A_SECOND, GAP_S = (0.0, 0.01), (1.0, 15.0)
OUTLIERS, OUTLIER_MPS, OUTLIER_M = (0.0, 0.01), 0.7, 3.0
LOST = (0.0, 0.005)


@dataclass(frozen=True, slots=True)
class Sensors:
    """What is peculiar to the sensors of one vehicle.

    Attributes:
        accelerometer_offset_mps2, gyroscope_offset_radps: (3,) biases at the start.
        accelerometer_scale, gyroscope_scale: (3,) relative errors.
        vibration_mps2, vibration_radps: standard deviation in each IMU sample, beside the sensor's own noise.
        wander_s: correlation time of the biases.
        dvl_rate_hz: samples a second. dvl_noise_mps: at rest. dvl_noise: and for each m/s.
        dvl_arm_m: (3,) from the IMU to it. dvl_mounting_rad: (3,) rotation vector from the hull's axes to its own.
        dvl_scale: relative error. dvl_delay_s: its samples are stamped so much later than they are measured.
        depth_rate_hz, depth_noise_m, depth_offset_m, depth_delay_s: likewise.
        gaps_a_second, outliers, lost: how often the DVL loses the bottom, share of wrong samples and of lost ones.
    """

    accelerometer_offset_mps2: Vector
    gyroscope_offset_radps: Vector
    accelerometer_scale: Vector
    gyroscope_scale: Vector
    vibration_mps2: float
    vibration_radps: float
    wander_s: float
    dvl_rate_hz: float
    dvl_noise_mps: float
    dvl_noise: float
    dvl_arm_m: Vector
    dvl_mounting_rad: Vector
    dvl_scale: float
    dvl_delay_s: float
    depth_rate_hz: float
    depth_noise_m: float
    depth_offset_m: float
    depth_delay_s: float
    gaps_a_second: float
    outliers: float
    lost: float


def random_sensors(rng: np.random.Generator, arm_m: Vector, *, rough: bool) -> Sensors:
    """Of a vehicle on which a DVL can be as far from the IMU as `arm_m`, (3,)."""
    axis = rng.standard_normal(3)
    return Sensors(
        accelerometer_offset_mps2=_vector(ACCELEROMETER_OFFSET_MPS2 * rng.standard_normal(3)),
        gyroscope_offset_radps=_vector(GYROSCOPE_OFFSET_RADPS * rng.standard_normal(3)),
        accelerometer_scale=_vector(SENSITIVITY * rng.standard_normal(3)),
        gyroscope_scale=_vector(SENSITIVITY * rng.standard_normal(3)),
        vibration_mps2=rng.uniform(*VIBRATION_MPS2),
        vibration_radps=rng.uniform(*VIBRATION_RADPS),
        wander_s=rng.uniform(*WANDER_S),
        dvl_rate_hz=float(rng.choice(DVL_RATES_HZ)),
        dvl_noise_mps=rng.uniform(*DVL_NOISE_MPS),
        dvl_noise=rng.uniform(*DVL_NOISE),
        dvl_arm_m=_vector(rng.uniform(-1.0, 1.0, 3) * arm_m),
        dvl_mounting_rad=_vector(rng.uniform(*DVL_MOUNTING_RAD) * axis / np.linalg.norm(axis)),
        dvl_scale=rng.uniform(*DVL_SCALE),
        dvl_delay_s=rng.uniform(*DVL_DELAY_S),
        depth_rate_hz=float(rng.choice(DEPTH_RATES_HZ)),
        depth_noise_m=rng.uniform(*DEPTH_NOISE_M),
        depth_offset_m=DEPTH_OFFSET_M * rng.standard_normal(),
        depth_delay_s=rng.uniform(*DEPTH_DELAY_S),
        gaps_a_second=rng.uniform(*GAPS_A_SECOND) * rough,
        outliers=rng.uniform(*OUTLIERS) * rough,
        lost=rng.uniform(*LOST) * rough,
    )


def measured_inertial(rng: np.random.Generator, sensors: Sensors, motion: Motion, duration_s: float) -> FloatArray:
    """(N, 7) at `IMU_HZ`: time, specific force, angular rate, each the mean over the interval before its stamp."""
    time_s = np.arange(0.0, duration_s, 1.0 / IMU_HZ)
    middle_s = time_s - 0.5 / IMU_HZ
    wander = _wander(rng, time_s, sensors.wander_s)
    force_mps2 = motion.specific_force_mps2(middle_s) * (1.0 + np.array(sensors.accelerometer_scale))
    rate_radps = motion.angular_rate_radps(middle_s) * (1.0 + np.array(sensors.gyroscope_scale))
    force_mps2 += sensors.accelerometer_offset_mps2 + ACCELEROMETER_WANDER_MPS2 * wander[:, :3]
    rate_radps += sensors.gyroscope_offset_radps + GYROSCOPE_WANDER_RADPS * wander[:, 3:]
    force_noise_mps2 = np.hypot(ACCELEROMETER_DENSITY * np.sqrt(IMU_HZ), sensors.vibration_mps2)
    rate_noise_radps = np.hypot(GYROSCOPE_DENSITY * np.sqrt(IMU_HZ), sensors.vibration_radps)
    force_mps2 += force_noise_mps2 * rng.standard_normal(force_mps2.shape)
    rate_radps += rate_noise_radps * rng.standard_normal(rate_radps.shape)
    return _without_lost(rng, sensors, np.column_stack([time_s, force_mps2, rate_radps]))


def measured_velocity(rng: np.random.Generator, sensors: Sensors, motion: Motion, duration_s: float) -> FloatArray:
    """(M, 4) time and velocity over ground as the DVL measures it."""
    time_s = _instants(rng, sensors.dvl_rate_hz, duration_s)
    true_mps = motion.body_velocity_mps(time_s - sensors.dvl_delay_s, sensors.dvl_arm_m)
    turned_mps = Rotation.from_rotvec(sensors.dvl_mounting_rad).inv().apply(true_mps)
    speed_mps = np.linalg.norm(true_mps, axis=1, keepdims=True)
    noise_mps = (sensors.dvl_noise_mps + sensors.dvl_noise * speed_mps) * (1.0, 1.0, DVL_VERTICAL)
    measured_mps = (1.0 + sensors.dvl_scale) * turned_mps + noise_mps * rng.standard_normal(turned_mps.shape)
    wrong = rng.random((len(time_s), 1)) < sensors.outliers
    measured_mps += wrong * OUTLIER_MPS * rng.standard_normal(turned_mps.shape)
    rows = _without_lost(rng, sensors, np.column_stack([time_s, measured_mps]))
    return rows[~_gone(rng, sensors, rows[:, 0])]


def measured_depth(rng: np.random.Generator, sensors: Sensors, motion: Motion, duration_s: float) -> FloatArray:
    """(K, 2) time and depth."""
    time_s = _instants(rng, sensors.depth_rate_hz, duration_s)
    depth_m = motion.position(time_s - sensors.depth_delay_s)[:, 2] + sensors.depth_offset_m
    depth_m += sensors.depth_noise_m * rng.standard_normal(len(time_s))
    depth_m += OUTLIER_M * rng.standard_normal(len(time_s)) * (rng.random(len(time_s)) < sensors.outliers)
    return _without_lost(rng, sensors, np.column_stack([time_s, depth_m]))


def thinned(imu: FloatArray, rate_hz: float) -> FloatArray:
    """(N', 7) what an IMU of a lower rate says: the means of as many samples, stamped like the last of them.

    Args:
        imu: (N, 7) at an even rate.
        rate_hz: into which its own rate goes a whole number of times.

    Raises:
        ValueError: it does not.
    """
    own_hz = (len(imu) - 1) / (imu[-1, 0] - imu[0, 0])
    count = round(own_hz / rate_hz)
    if count < 1 or abs(own_hz / count / rate_hz - 1.0) > 0.02:
        raise ValueError(f"rate_hz = {rate_hz}: want a whole fraction of {own_hz:.1f}")
    blocks = imu[: len(imu) // count * count].reshape(-1, count, imu.shape[1])
    return np.column_stack([blocks[:, -1, 0], blocks[:, :, 1:].mean(axis=1)])


def _instants(rng: np.random.Generator, rate_hz: float, duration_s: float) -> FloatArray:
    return np.asarray(np.arange(rng.random(), duration_s * rate_hz) / rate_hz)


def _wander(rng: np.random.Generator, time_s: FloatArray, correlated_s: float) -> FloatArray:
    """(N, 6) of unit deviation, drawn once a second: first-order Gauss-Markov processes."""
    seconds = np.arange(0.0, time_s[-1] + 1.0)
    keep = np.exp(-1.0 / correlated_s)
    white = np.sqrt(1.0 - keep**2) * rng.standard_normal((len(seconds), 6))
    white[0] /= np.sqrt(1.0 - keep**2)
    slow = lfilter([1.0], [1.0, -keep], white, axis=0)
    return np.column_stack([np.interp(time_s, seconds, column) for column in slow.T])


def _without_lost(rng: np.random.Generator, sensors: Sensors, rows: FloatArray) -> FloatArray:
    return rows[rng.random(len(rows)) >= sensors.lost]


def _gone(rng: np.random.Generator, sensors: Sensors, time_s: FloatArray) -> NDArray[np.bool_]:
    """(M,) whether the DVL does not see the bottom."""
    gone = np.zeros(len(time_s), dtype=bool)
    for begin_s in rng.uniform(0.0, time_s[-1], rng.poisson(sensors.gaps_a_second * time_s[-1])):
        gone |= (time_s >= begin_s) & (time_s < begin_s + rng.uniform(*GAP_S))
    return gone


def _vector(values: FloatArray) -> Vector:
    first, second, third = values.tolist()
    return first, second, third
