"""The speed detector: guards its input, and hands it to the method that the configuration names."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import isfinite, nan

from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve
from detectors.speed.observed import ObservedMethod
from detectors.speed.published import PublishedMethod
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.verdict import Level

FARTHEST_M = 1e8  # from any origin on earth, and ...
LATEST_S = 1e12  # ... some ten thousand years: beyond these no sample makes sense
ANGLE_MAX_RAD = 1e6  # of a heading that counts its turns


class SpeedDetector:
    """Watches one vehicle: its speed through the water against what is normal, in water that moves.

    Picklable at any sample; unpickled, it goes on bit for bit.

    Args:
        config: settings.
        curve: normal speed over the command, from an earlier dive; None: learnt, or as the settings say.

    Attributes:
        refused: samples and positions that were not used, by cause.

    >>> detector = SpeedDetector(SpeedConfig(speed_min_mps=0.8, speed_max_mps=1.2))
    >>> detector.update(PoseSample(0.0, north_m=0.0, east_m=0.0, heading_rad=0.5)).level.name
    'UNKNOWN'
    """

    def __init__(self, config: SpeedConfig | None = None, curve: SpeedCurve | None = None) -> None:
        self.config = config or SpeedConfig()
        self._method: ObservedMethod | PublishedMethod = (
            PublishedMethod(self.config)
            if self.config.estimator == "published"
            else ObservedMethod(self.config, curve)
        )
        self.refused: Counter[str] = self._method.refused if isinstance(self._method, ObservedMethod) else Counter()
        self._last = SpeedVerdict(
            time_s=nan, level=Level.UNKNOWN, score=0.0, speed_mps=nan, flow_mps=(nan,) * self.config.dimensions,
            flag=2, reason="learning",
        )  # fmt: skip

    @property
    def curve(self) -> SpeedCurve | None:
        """Normal speed over the command, as far as it is known."""
        return self._method.normal.curve if isinstance(self._method, ObservedMethod) else None

    def accept(self) -> None:
        """An operator's act: the vehicle is as it should be. A fault is over, its present speed is the normal one."""
        self._method.accept()

    def resume(self) -> None:
        """After a restart of the program: the clock may be another, and what is wrong is to be found anew."""
        self._last = replace(self._last, time_s=nan)
        if isinstance(self._method, ObservedMethod):
            self._method.resume()

    def update(self, sample: PoseSample) -> SpeedVerdict:
        """Judge the next sample. Never raises on data.

        A sample that is not finite, beyond all range, or not later than the last one, is refused and counted in
        `refused`; the last verdict stands. A position that repeats the last one, or is far from where it can be, is
        counted, too, and only the heading is taken.
        """
        cause = self._cause_to_refuse(sample)
        if cause:
            self.refused[cause] += 1
            return self._last
        self._last = self._method.judge(_sensible(sample))
        return self._last

    def _cause_to_refuse(self, sample: PoseSample) -> str:
        position = (sample.north_m, sample.east_m, sample.down_m)
        angles = (sample.heading_rad, sample.pitch_rad)
        if not all(map(isfinite, (sample.time_s, *position, *angles))):
            return "not finite"
        far = max(map(abs, position)) > FARTHEST_M or max(map(abs, angles)) > ANGLE_MAX_RAD
        if far or abs(sample.time_s) > LATEST_S:
            return "out of range"
        return "late or repeated" if sample.time_s <= self._last.time_s else ""


def _sensible(sample: PoseSample) -> PoseSample:
    """Commands within their range; what is none counts as not known."""
    command = None if sample.command is None or not isfinite(sample.command) else sample.command
    sideways = sample.sideways if isfinite(sample.sideways) else 0.0
    return replace(
        sample,
        command=None if command is None else min(max(command, -1.0), 1.0),
        sideways=min(max(sideways, -1.0), 1.0),
    )
