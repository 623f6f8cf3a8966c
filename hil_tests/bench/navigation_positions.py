"""Where a vehicle believes itself to be after 1000 s with a DVL that fails again and again (figure 14 of paper 003).

The numbers of the paper's table 3 are lost in our text of it; in words: a step from 100 to 120 s, gradual faults
after it. `FAULTS` is what is assumed. As there, an acoustic system takes over while the DVL is isolated, and only
then. An autopilot's attitude, with a compass, is told all the time: else the heading would drift away, whatever the
DVL does, with a gyroscope of this class.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import FixSample, NavigationConfig, NavigationSample, NavigationVerdict, Sensor
from hil_tests.bench.navigation_cases import Source
from hil_tests.bench.navigation_trace import MakeWatch, initial_of, seed_of
from hil_tests.navigation_aids import acoustic_fixes, compass_attitudes
from hil_tests.navigation_trials import Watch, Way, faulty, play, position_errors_m, samples, track_m
from hil_tests.sensor_faults import Kind, SensorFault

FloatArray = NDArray[np.float64]

FIX_NOISE_M = 3.0
DURATION_S = 1000.0
# kind, size, onset and end in seconds, all along the hull
FAULTS: tuple[tuple[Kind, float, float, float], ...] = (
    ("step", 1.0, 100.0, 120.0),
    ("drift", 0.02, 250.0, 300.0),
    ("drift", 0.04, 450.0, 500.0),
    ("quadratic", 0.002, 650.0, 700.0),
    ("drift", 0.08, 850.0, 900.0),
)


@dataclass(frozen=True, slots=True)
class Variant:
    """A way to deal with the faults.

    Attributes:
        name: of it. config: of the detector. broken: whether there are faults at all.
    """

    name: str
    config: NavigationConfig
    broken: bool = True


class TakingOver:
    """A detector that is told of fixes only while the DVL is isolated."""

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._newest: NavigationVerdict | None = None

    def update(self, sample: NavigationSample) -> NavigationVerdict:
        newest = self._newest
        if newest is None or not isinstance(sample, FixSample) or Sensor.DVL in newest.isolated:
            newest = self._newest = self._watch.update(sample)
        return newest


def variants(config: NavigationConfig, methods: tuple[str, ...]) -> list[Variant]:
    """Without faults, without isolation, and isolating by each method."""
    isolating = [Variant(name, replace(config, method=name, isolate=True)) for name in methods]  # type: ignore[arg-type]
    return [
        Variant("no faults", replace(config, isolate=True), broken=False),
        Variant("not isolated", replace(config, isolate=False)),
        *isolating,
    ]


def way(source: Source, variant: Variant, make: MakeWatch, faults: tuple[SensorFault, ...] | None = None) -> Way:
    """Plays one dive.

    Args:
        faults: None: `FAULTS`.
    """
    data = source.load()
    broken = dvl_faults(float(data.imu[0, 0])) if faults is None else faults
    watch = TakingOver(make(variant.config, initial_of(source, data)))
    fixes = acoustic_fixes(data, seed_of(source), FIX_NOISE_M)
    attitudes = compass_attitudes(data, seed_of(source))
    record = play(watch, samples(faulty(data, broken if variant.broken else ()), fixes, attitudes))
    return Way(
        variant=variant.name,
        dive=source.name,
        time_s=record.time_s - data.imu[0, 0],
        error_m=position_errors_m(record, data),
        isolated=record.isolated[:, tuple(Sensor).index(Sensor.DVL)],
        believed_m=track_m(data, record.position),
        true_m=track_m(data, np.empty((0, 2)) if data.reference is None else data.reference[:, 1:3]),
    )


def errors_m(ways: Iterable[Way]) -> dict[str, list[tuple[float, float]]]:
    """Last and greatest error of each dive, by variant."""
    pairs: dict[str, list[tuple[float, float]]] = {}
    for one in ways:
        pairs.setdefault(one.variant, []).append((one.last_m, one.greatest_m))
    return pairs


def dvl_faults(begin_s: float = 0.0) -> tuple[SensorFault, ...]:
    """`FAULTS`, from the beginning of a dive on."""
    return tuple(
        SensorFault(sensor=Sensor.DVL, kind=kind, size=size, axis=0, onset_s=begin_s + onset_s, end_s=begin_s + end_s)
        for kind, size, onset_s, end_s in FAULTS
    )
