"""Faults put into what a navigation sensor measures: the shapes of paper 003, section 2, and what users report.

A fault is a value; it is put into whole recordings at once, or into one sample after the other with the same result.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, isfinite, pi, sin
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import FaultKind, Sensor

FloatArray = NDArray[np.float64]
Kind = Literal[
    "step", "drift", "quadratic", "zero", "stuck", "intermittent", "dropping", "stop", "noise", "scale", "beam"
]

# What `size` is of, in the sensor's unit; the others have none.
SIZED: dict[Kind, str] = {
    "step": "offset",
    "drift": "offset a second",
    "quadratic": "offset a second squared",
    "noise": "standard deviation of what is added",
    "scale": "share of the true value that is added",
    "beam": "error of the velocity along the beam",
}
# What a detector is to call it.
CALLED: dict[Kind, FaultKind] = {
    "step": FaultKind.STEP,
    "drift": FaultKind.DRIFT,
    "quadratic": FaultKind.DRIFT,
    "zero": FaultKind.STUCK,
    "stuck": FaultKind.STUCK,
    "intermittent": FaultKind.INTERMITTENT,
    "dropping": FaultKind.INTERMITTENT,
    "stop": FaultKind.UNCLEAR,  # there is nothing to be judged
    "noise": FaultKind.NOISE,
    "scale": FaultKind.SCALE,
    "beam": FaultKind.STEP,
}

INTERRUPTED_S = 1.0  # an intermittent sensor is gone for so long, and back for as long
BEAM_ANGLE_RAD = pi / 6.0  # of a DVL's four beams from the vertical
BEAM_AZIMUTHS_RAD = (0.25 * pi, 0.75 * pi, 1.25 * pi, 1.75 * pi)  # Janus: between the axes of the hull


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault:
    """One fault of one sensor.

    Attributes:
        sensor: which. Its unit is that of its values: m/s, m, rad/s or m/s2.
        kind: "step", "drift" and "quadratic" (the offset grows with time and with its square) are added to the true
            value; "zero": only zeros; "stuck": the value before the onset again and again; "intermittent": zeros
            every other second; "dropping": nothing every other second; "stop": nothing at all; "noise"; "scale";
            "beam": one of a DVL's beams is wrong, see `beam_error`.
        onset_s: when it begins.
        end_s: when it is gone again.
        axis: 0 forward, 1 right, 2 down, or None for all of them; of a "beam" its number, 0 to 3; None for depth.
        size: see `SIZED`.
        seed: of "noise".

    Raises:
        ValueError: something is out of its range, or does not fit together.
    """

    sensor: Sensor
    kind: Kind
    onset_s: float
    end_s: float = inf
    axis: int | None = None
    size: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        _want("sensor", self.sensor, self.sensor in set(Sensor), f"one of {', '.join(Sensor)}")
        _want("kind", self.kind, self.kind in get_args(Kind), f"one of {', '.join(get_args(Kind))}")
        _want("onset_s", self.onset_s, isfinite(self.onset_s), "a finite time")
        _want("end_s", self.end_s, self.end_s > self.onset_s, f"a time after onset_s = {self.onset_s}")
        if self.kind in SIZED:
            _want("size", self.size, isfinite(self.size) and self.size != 0.0, f"the {SIZED[self.kind]}, not 0")
            _want("size", self.size, self.size > 0.0 or self.kind != "noise", "more than 0 for noise")
        else:
            _want("size", self.size, self.size == 0.0, f"0: {self.kind!r} has no size")
        self._check_axis()

    def _check_axis(self) -> None:
        if self.kind == "beam":
            _want("sensor", self.sensor, self.sensor == Sensor.DVL, "dvl: nothing else has beams")
            _want("axis", self.axis, self.axis in range(len(BEAM_AZIMUTHS_RAD)), "the beam's number, 0 to 3")
        elif self.sensor == Sensor.DEPTH:
            _want("axis", self.axis, self.axis is None, "None: a depth has no axes")
        else:
            _want("axis", self.axis, self.axis in (None, 0, 1, 2), "0, 1, 2 or None")

    @property
    def called(self) -> FaultKind:
        """What a detector is to call it."""
        return CALLED[self.kind]

    def active(self, time_s: FloatArray) -> NDArray[np.bool_]:
        """(N,) whether it is there."""
        return np.asarray((time_s >= self.onset_s) & (time_s < self.end_s))

    def apply(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """A recording with the fault in it.

        Args:
            time_s: (N,) rising.
            values: (N, 3) what is measured, or (N,).

        Returns:
            As `values`; NaN where the sensor says nothing.

        Raises:
            ValueError: the shapes do not fit together, or not to the fault.
        """
        _check_shapes(self, time_s, values)
        rows = np.asarray(values, dtype=float).reshape(len(time_s), -1)
        return Injector(self).rows(np.asarray(time_s, dtype=float), rows).reshape(values.shape)


class Injector:
    """Puts a fault into one sample after the other. Picklable."""

    def __init__(self, fault: SensorFault) -> None:
        self.fault = fault
        self._random = np.random.default_rng(fault.seed)
        self._held: FloatArray | None = None  # the newest value from before the onset

    def sample(self, time_s: float, value: tuple[float, ...]) -> tuple[float, ...] | None:
        """What the sensor says instead of the value; None for nothing.

        Args:
            time_s: not earlier than that of the sample before.
            value: (3,) or (1,).
        """
        said = self.rows(np.array([time_s]), np.array([value], dtype=float))[0]
        return None if np.isnan(said).any() else tuple(said.tolist())

    def rows(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """(N, 3) or (N, 1) with the fault in them, for (N,) instants; NaN where the sensor says nothing."""
        acting = self.fault.active(time_s)
        healthy = values[time_s < self.fault.onset_s]
        if len(healthy):
            self._held = healthy[-1].copy()
        said = values.copy()
        if acting.any():
            self._held = values[acting][0].copy() if self._held is None else self._held
            axes = slice(None) if self.fault.axis is None or self.fault.kind == "beam" else self.fault.axis
            said[acting, axes] = self._faulty(time_s[acting], values[acting])[:, axes]
        if self.fault.kind in ("dropping", "stop"):  # a sample comes as a whole, or not
            said[np.isnan(said).any(axis=1)] = np.nan
        return said

    def _faulty(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """All components of (N,) samples in which the fault acts."""
        since_s = (time_s - self.fault.onset_s)[:, np.newaxis]
        if self.fault.kind in SIZED:
            return np.asarray(values + self._error(since_s, values))
        return self._instead(since_s, values)

    def _error(self, since_s: FloatArray, values: FloatArray) -> FloatArray | float:
        """What is added to the true values, (N, 3) or what goes with it."""
        size = self.fault.size
        match self.fault.kind:
            case "noise":
                return size * self._random.standard_normal(values.shape)
            case "scale":
                return size * values
            case "beam":
                return beam_error(self.fault.axis or 0, size)
            case kind:
                return np.asarray(size * since_s ** ("step", "drift", "quadratic").index(kind))

    def _instead(self, since_s: FloatArray, values: FloatArray) -> FloatArray:
        """(N, 3) what stands for the true values."""
        gone = np.floor(since_s / INTERRUPTED_S) % 2.0 == 0.0
        match self.fault.kind:
            case "stuck":
                return np.broadcast_to(np.asarray(self._held), values.shape)
            case "zero":
                return np.zeros_like(values)
            case "intermittent":
                return np.where(gone, 0.0, values)
            case "dropping":
                return np.where(gone, np.nan, values)
            case _:
                return np.full_like(values, np.nan)


def beam_directions() -> FloatArray:
    """(4, 3) unit vectors along a DVL's beams, forward, right, down."""
    slant, down = sin(BEAM_ANGLE_RAD), cos(BEAM_ANGLE_RAD)
    return np.array([(slant * cos(azimuth), slant * sin(azimuth), down) for azimuth in BEAM_AZIMUTHS_RAD])


def beam_error(beam: int, error_mps: float) -> FloatArray:
    """(3,) what a DVL's velocity is off by, when that along one beam is.

    The velocity is the least-squares solution of the four beams, v = (A'A)^-1 A'b, so that an error of one goes in
    with a column of it. The solution of the three others differs from that of all four by a vector of this very
    direction (four beams and three unknowns leave one residual), so that a beam that is lost shows on the same axis:
    by what the beams disagreed.
    """
    return np.asarray(np.linalg.pinv(beam_directions())[:, beam] * error_mps)


def _check_shapes(fault: SensorFault, time_s: FloatArray, values: FloatArray) -> None:
    wanted = (len(time_s),) if fault.sensor == Sensor.DEPTH else (len(time_s), 3)
    if values.shape != wanted:
        raise ValueError(f"values of shape {values.shape}: want {wanted} for the {fault.sensor}")


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled:
        raise ValueError(f"{name} = {value!r}: want {wanted}")
