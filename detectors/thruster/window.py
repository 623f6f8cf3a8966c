"""The samples that a model is learnt from, and how they are made ready for it."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from detectors.thruster.curve import CommandBasis
from detectors.thruster.history import COMMAND, CURRENT, SPEED, TIME, TRUSTED, VOLTAGE, History
from detectors.thruster.lag import lagged

FloatArray = NDArray[np.float64]

RUN_IN = 40  # samples at the window's start whose lag state is not known
SHARE_MIN = 15  # samples beyond a command before the commands up to it count as learnt
GAP_PERIODS = 1.8  # a step in time of more than this many periods is a gap
SPIKE = 0.1  # relative error of a single sample beyond its neighbours that is left out
PULSE_WIDTHS_US = (800.0, 2200.0)
PULSE_NEUTRAL_US = 1500.0
TREND_SAMPLES = 1500.0  # time scale of the gain's drift


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """The samples to learn from: (N,) each, but the command, which has some earlier ones in front.

    Attributes:
        trusted: samples to learn from; the others are only passed through.
        voltage_v, current_a: NaN where not measured.
    """

    command: FloatArray
    speed_rpm: FloatArray
    trusted: NDArray[np.bool_]
    voltage_v: FloatArray
    current_a: FloatArray

    @property
    def lead(self) -> int:
        """Number of earlier commands in front: the longest delay that can be looked at."""
        return len(self.command) - len(self.speed_rpm)


def window_of(history: History, start: int, stop: int, lead: int) -> tuple[Window, float]:
    """Samples number start..stop-1 to learn from, and their period in seconds.

    Single wild readings are not trusted, nor are the samples just after a gap in time.
    """
    steps = np.abs(np.diff(history.row(TIME, start, stop)))  # after a restart, another clock may be behind
    period_s = float(np.median(steps))
    trusted = (history.row(TRUSTED, start, stop) > 0.0) & ~_spikes(history.row(SPEED, start, stop))
    for before in np.flatnonzero(steps > GAP_PERIODS * period_s):
        trusted[before + 1 : before + 1 + RUN_IN // 2] = False
    window = Window(
        command=history.row(COMMAND, start - lead, stop).copy(),
        speed_rpm=history.row(SPEED, start, stop).copy(),
        trusted=trusted,
        voltage_v=history.row(VOLTAGE, start, stop).copy(),
        current_a=history.row(CURRENT, start, stop).copy(),
    )
    return window, period_s


def _spikes(speed_rpm: FloatArray) -> NDArray[np.bool_]:
    """(N,) single readings far off both neighbours; a step of the speed is none."""
    line = np.concatenate([speed_rpm[:1], speed_rpm, speed_rpm[-1:]])
    middle = np.sort(np.stack([line[:-2], line[1:-1], line[2:]]), axis=0)[1]
    return np.asarray(np.abs(speed_rpm - middle) > SPIKE * np.quantile(np.abs(middle), 0.995))


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """A window made ready: speeds with a sign, in top speeds, and the columns that may explain them.

    Attributes:
        basis: what the columns are.
        columns: (K, lead + N) of the static curve.
        lead: earlier commands in front.
        top_rpm: speed that speeds are given in.
        speed: (N,) measured.
        usable: (N,) samples to learn from.
        time: (N,) 0 at the newest, in `TREND_SAMPLES`.
        supply: (N,) relative deviation of the supply voltage from `supply_v`, 0 where not measured.
        supply_v: nominal supply voltage of the window, NaN where not measured.
        unsigned: whether the sensor gives the magnitude of the speed only.
    """

    basis: CommandBasis
    columns: FloatArray
    lead: int
    top_rpm: float
    speed: FloatArray
    usable: NDArray[np.bool_]
    time: FloatArray
    supply: FloatArray
    supply_v: float
    unsigned: bool

    def static(self, delay: int) -> FloatArray:
        """(K, N) columns after this delay."""
        return self.columns[:, self.lead - delay : self.columns.shape[1] - delay]

    def lagged(self, delay: int, lag: float) -> FloatArray:
        """(K, N) columns after this delay and lag: as they show in the speed."""
        moved = lagged(self.columns, lag)
        return moved[:, self.lead - delay : moved.shape[1] - delay]


def prepare(window: Window, order_max: int, usable_min: int) -> Prepared | None:
    """The window made ready; None where it shows too little: at rest, or too few trusted samples."""
    neutral = neutral_of(window.command)
    command = window.command - neutral
    scale = float(np.abs(command).max())
    top_rpm = float(np.quantile(np.abs(window.speed_rpm), 0.995))
    if scale <= 0.0 or top_rpm <= 0.0:
        return None
    astern = bool(np.count_nonzero(command < -0.01 * scale) > SHARE_MIN)
    unsigned = not bool((window.speed_rpm < -0.02 * top_rpm).any())
    speed, usable = window.speed_rpm / top_rpm, window.trusted.copy()
    usable[:RUN_IN] = False
    if unsigned and astern:
        speed, certain = _signed(command, speed, window.lead)
        usable &= certain
    if np.count_nonzero(usable) < usable_min:
        return None
    basis = CommandBasis(scale, order_max, astern, neutral)
    supply_v, supply = _supply(window.voltage_v)
    time = (np.arange(len(speed)) - (len(speed) - 1)) / TREND_SAMPLES
    columns = basis.columns(window.command)
    return Prepared(basis, columns, window.lead, top_rpm, speed, usable, time, supply, supply_v, unsigned)


def neutral_of(command: FloatArray) -> float:
    """The command that asks for no speed: 0, but the middle of the range for servo pulse widths in microseconds."""
    low, high = PULSE_WIDTHS_US
    return PULSE_NEUTRAL_US if bool(((command >= low) & (command <= high)).all()) else 0.0


def _supply(voltage_v: FloatArray) -> tuple[float, FloatArray]:
    """Nominal supply voltage, and each sample's relative deviation from it."""
    measured = np.isfinite(voltage_v)
    if np.count_nonzero(measured) <= len(voltage_v) // 2:
        return nan, np.zeros(len(voltage_v))
    nominal = float(np.median(voltage_v[measured]))
    if nominal <= 0.0:
        return nan, np.zeros(len(voltage_v))
    return nominal, np.where(measured, voltage_v / nominal - 1.0, 0.0)


def _signed(command: FloatArray, speed: FloatArray, delay_max: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Sign for speeds of a sensor without one, from the command; uncertain within `delay_max` of a reversal."""
    sign = np.sign(command)
    views = sliding_window_view(sign, delay_max + 1)[-len(speed) :]
    certain = (views.min(axis=1) == views.max(axis=1)) & (views[:, 0] != 0.0)
    return np.abs(speed) * np.where(sign[-len(speed) :] < 0.0, -1.0, 1.0), certain
