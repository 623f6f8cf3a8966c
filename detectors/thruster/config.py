"""Settings of the thruster detector."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from detectors.thruster.search import SearchName

PAPER_DEFAULTS = {"window_min": 50, "window_max": 500, "warmup": 500}  # paper 000, section 6
CAUTION_MIN, CAUTION_MAX = 0.5, 10.0
OUR_DEFAULTS = {"window_min": 300, "window_max": 2500, "warmup": 400}


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrusterConfig:
    """Settings of the thruster detector; lengths are in samples.

    `ThrusterConfig(dynamics=False, search="swarm", threshold_rpm=80)` is the method of paper 000 to the letter; a
    window or warm-up that is not given then takes the paper's value.

    Attributes:
        threshold_rpm: fixed bound of the residual, None for an automatic one.
        caution: multiplies the automatic threshold: a change must be so many times as large to be a fault. `gateway
            commission` finds it for a wanted rate of false alarms.
        window_min, window_max: fewest and most samples that a model is fitted to (paper 000, section 4.3, step 4).
        order_max: highest order of the polynomial.
        delay_max: longest transport delay that is searched.
        lag_max: longest motor lag (time constant) that is searched; only with dynamics.
        search: how order and window are chosen: over the whole grid, or by the paper's swarm.
        dynamics: True for a model with motor lag and the test for lasting changes, False for the paper's method.
        warmup: samples before the first model.
        wear_suspect, wear_max: relative drift from the commissioned curve that is SUSPECT, and FAULT.
        seed: of the swarm's random numbers.

    Raises:
        ValueError: a setting out of its range.
    """

    threshold_rpm: float | None = None
    caution: float = 1.0
    window_min: int | None = None
    window_max: int | None = None
    order_max: int = 5
    delay_max: int = 12
    lag_max: float = 12.0
    search: SearchName = "exact"
    dynamics: bool = True
    warmup: int | None = None
    wear_suspect: float = 0.12
    wear_max: float = 0.20
    seed: int = 0

    def __post_init__(self) -> None:
        defaults = OUR_DEFAULTS if self.dynamics else PAPER_DEFAULTS
        for name, value in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        self._check()

    def _check(self) -> None:
        window_min, window_max, warmup = self.spans
        _want("threshold_rpm", self.threshold_rpm, self.threshold_rpm is None or self.threshold_rpm > 0, "above 0")
        _want("caution", self.caution, CAUTION_MIN <= self.caution <= CAUTION_MAX, f"{CAUTION_MIN} to {CAUTION_MAX}")
        _want("order_max", self.order_max, 1 <= self.order_max <= 9, "1 to 9")
        _want("delay_max", self.delay_max, 0 <= self.delay_max <= 200, "0 to 200")
        _want("lag_max", self.lag_max, 0 < self.lag_max <= 200, "above 0, to 200")
        _want("window_min", window_min, window_min > 2 * self.order_max, f"above {2 * self.order_max}")
        _want("window_max", window_max, window_max >= window_min, f"at least window_min = {window_min}")
        least = window_min + self.delay_max
        _want("warmup", warmup, warmup >= least, f"at least window_min + delay_max = {least}")
        _want("search", self.search, self.search in ("exact", "swarm"), "'exact' or 'swarm'")
        _want("wear_suspect", self.wear_suspect, 0 < self.wear_suspect < 1, "between 0 and 1")
        ordered = self.wear_suspect < self.wear_max < 1
        _want("wear_max", self.wear_max, ordered, f"between wear_suspect = {self.wear_suspect} and 1")

    @property
    def spans(self) -> tuple[int, int, int]:
        """window_min, window_max and warmup, resolved."""
        assert self.window_min is not None and self.window_max is not None and self.warmup is not None  # noqa: S101
        return self.window_min, self.window_max, self.warmup


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled or (isinstance(value, float) and not isfinite(value)):
        raise ValueError(f"{name} = {value!r}: want {wanted}")
