"""A Doppler velocity log with its driver, which tells velocity over ground by VISION_POSITION_DELTA."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from detectors.navigation import Sensor
from hil_tests.rig.injection import Injection
from hil_tests.rig.kinematics import Vector, added, attitude_rad, scaled, velocity_at
from hil_tests.rig.vehicle import Motion
from hil_tests.sensor_faults import SensorFault

# As Water Linked's extension for BlueOS sends.
SYSTEM_ID, COMPONENT_ID = 255, 0
WORST_NOISE_MPS = 0.4  # the extension calls this a confidence of 0 %
EARLY_S = 1e-6  # times are sums of steps, and rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class DvlErrors:
    """How a DVL is built in and how far off it is; the defaults are of a Water Linked A50 on a BlueROV2.

    Attributes:
        interval_s: from ping to ping.
        noise_mps: standard deviation of each component.
        lever_arm_m: its place in the body, from where the IMU is: forward, right, down.
        delay_s: from a ping to the message, which is stamped when it is sent.

    Raises:
        ValueError: a number is out of its range.
    """

    interval_s: float = 0.2
    noise_mps: float = 0.007
    lever_arm_m: Vector = (-0.15, 0.0, 0.12)
    delay_s: float = 0.15

    def __post_init__(self) -> None:
        _want("interval_s", self.interval_s, isfinite(self.interval_s) and self.interval_s > 0.0, "seconds above 0")
        _want("noise_mps", self.noise_mps, 0.0 <= self.noise_mps < WORST_NOISE_MPS, f"0 to below {WORST_NOISE_MPS}")
        _want("lever_arm_m", self.lever_arm_m, all(map(isfinite, self.lever_arm_m)), "three finite numbers")
        _want("delay_s", self.delay_s, isfinite(self.delay_s) and self.delay_s >= 0.0, "0 or more seconds")


@dataclass(frozen=True, slots=True)
class _Ping:
    """What was measured, and when the message of it is sent, in seconds since the start."""

    sent_s: float
    velocity_mps: Vector
    attitude_rad: Vector


class DopplerLog:
    """Makes the messages; someone else sends them.

    Args:
        errors: how it is built in and how far off it is.
        seed: of the noise.
        faults: of the DVL among those of other sensors, in seconds since the start.
    """

    def __init__(self, errors: DvlErrors, seed: int, faults: Sequence[SensorFault] = ()) -> None:
        self._errors = errors
        self._random = np.random.default_rng([seed, 2])
        self._injection = Injection(Sensor.DVL, faults)
        self._pings = 0
        self._on_the_way: deque[_Ping] = deque()
        self._sent: _Ping | None = None

    def due(self, since_s: float, motion: Motion) -> Any | None:
        """Ping if it is time, and return the VISION_POSITION_DELTA that is due, or None.

        Args:
            since_s: since the start; goes on by steps that are shorter than the interval.
            motion: of the vehicle now.
        """
        if since_s > self._pings * self._errors.interval_s - EARLY_S:
            self._pings += 1
            self._ping(since_s, motion)
        if not self._on_the_way or since_s < self._on_the_way[0].sent_s - EARLY_S:
            return None
        before, self._sent = self._sent, self._on_the_way.popleft()
        return self._message(before or self._sent, self._sent)

    def _ping(self, since_s: float, motion: Motion) -> None:
        first, second, third = self._random.standard_normal(3).tolist()
        noise_mps = scaled(self._errors.noise_mps, (first, second, third))
        velocity_mps = added(velocity_at(motion, self._errors.lever_arm_m), noise_mps)
        said_mps = self._injection.vector(since_s, velocity_mps)
        if said_mps is not None:
            self._on_the_way.append(_Ping(since_s + self._errors.delay_s, said_mps, attitude_rad(motion)))

    def _message(self, before: _Ping, ping: _Ping) -> Any:
        """The way made since the last ping at the velocity of this one, as the extension reckons it."""
        way_m = scaled(self._errors.interval_s, ping.velocity_mps)
        turned_rad = added(ping.attitude_rad, scaled(-1.0, before.attitude_rad))
        confidence = 100.0 * (1.0 - self._errors.noise_mps / WORST_NOISE_MPS)
        interval_us = round(1e6 * self._errors.interval_s)
        return mavlink.MAVLink_vision_position_delta_message(
            round(1e6 * ping.sent_s), interval_us, turned_rad, way_m, confidence
        )


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled:
        raise ValueError(f"{name} = {value}: want {wanted}")
