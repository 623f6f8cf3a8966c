"""The thrusters' threshold for a wanted rate of false alarms, from the peaks that healthy scores reached.

All dives go through the detectors once more, with so much caution that nothing is ever found, and what their scores
would have been with none is put together: the greatest of all thrusters in each block of time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.thruster import ThrusterConfig, ThrusterDetector
from detectors.thruster.assessment import CONFIRM
from detectors.thruster.config import CAUTION_MAX
from detectors.thruster.evidence import CHANGE_MIN
from gateway.commissioning.part import Part, Quantity, Setting
from gateway.commissioning.peaks import BLOCK_S, RateBound, Tail, block_maxima, counted, tail
from gateway.commissioning.successive import successive
from gateway.commissioning.threshold_figures import threshold_figure
from gateway.commissioning.thruster import LearntThruster

FloatArray: TypeAlias = NDArray[np.float64]

SUBJECT = "thrusters"
KEY = "detector.thruster.caution"
BLOCKS_MIN = 30  # five minutes that are judged
CAUTION_LEAST = 0.8  # no less, however calm the dives: the tests have other assumptions than that of their threshold
CAUTION_MOST = 4.0  # with more, a thruster that has lost an eighth of its speed is not found


@dataclass(frozen=True, slots=True)
class HeldOut:
    """What a threshold from other dives would have said of those that it did not know.

    Attributes:
        events: blocks with a false alarm.
        hours: of all blocks.
    """

    events: int
    hours: float

    @property
    def rate(self) -> RateBound:
        """Of the false alarms."""
        return counted(self.events, self.hours)


@dataclass(frozen=True, slots=True)
class Threshold:
    """What was chosen.

    Attributes:
        caution: multiplies the thresholds.
        peaks: (B,) greatest scores of all blocks, with a caution of 1.
        tail: of the peaks.
        held_out: how it does on dives that are not in it.
    """

    caution: float
    peaks: FloatArray
    tail: Tail
    held_out: HeldOut | None


def commission_thresholds(
    thrusters: Sequence[LearntThruster], config: ThrusterConfig, false_alarms_per_hour: float
) -> Part:
    """Chooses the threshold of all thrusters.

    Args:
        thrusters: what was learnt of each; those of which something is missing have no say.
        config: settings of their detectors.
        false_alarms_per_hour: how many faults may be said of a healthy vehicle.
    """
    sound = [one for one in thrusters if one.sound]
    if not sound:
        return Part(SUBJECT, missing=("no thruster has enough to set a threshold by: see each of them",))
    peaks = dive_peaks(sound, config)
    judged = sum(map(len, peaks))
    found = threshold(peaks, false_alarms_per_hour)
    if judged < BLOCKS_MIN or found is None:
        minutes, wanted = judged * BLOCK_S / 60.0, BLOCKS_MIN * BLOCK_S / 60.0
        return Part(
            SUBJECT,
            missing=(
                f"{minutes:.1f} minutes of healthy driving could be judged, {wanted:.0f} are wanted for a threshold,"
                " an hour is good: record longer dives, with all manoeuvres that are usual",
            ),
        )
    figures = (threshold_figure(found.peaks, found.tail, found.caution, false_alarms_per_hour),)
    if found.caution > CAUTION_MOST:
        return Part(
            SUBJECT,
            quantities=tuple(_quantities(found)),
            missing=(
                f"healthy scores reach {float(found.peaks.max()):.1f} times the threshold: with a threshold for"
                f" {false_alarms_per_hour:g} false alarms per hour no fault would be found. Look at the thrusters'"
                " plots: does the speed follow the command, and are the times right?",
            ),
            figures=figures,
        )
    comment = f"for {false_alarms_per_hour:g} false alarms per hour, from {found.tail.hours:.2f} h of healthy dives"
    settings = (Setting(KEY, found.caution, comment),)
    return Part(SUBJECT, settings, quantities=tuple(_quantities(found)), figures=figures)


def threshold(peaks: Sequence[FloatArray], false_alarms_per_hour: float) -> Threshold | None:
    """The threshold for a rate of false alarms; None where there are too few peaks.

    Args:
        peaks: by dive, (B,) greatest scores of its blocks.
        false_alarms_per_hour: the rate that is wanted.
    """
    together = np.concatenate([*peaks, np.empty(0)])
    fitted = tail(together)
    if fitted is None:
        return None
    return Threshold(
        caution_for(fitted, false_alarms_per_hour), together, fitted, held_out(peaks, false_alarms_per_hour)
    )


def caution_for(fitted: Tail, false_alarms_per_hour: float) -> float:
    """The caution for a rate: as fitted; but below 1 only as far as that is sure."""
    likely, sure = fitted.threshold(false_alarms_per_hour), fitted.sure_threshold(false_alarms_per_hour)
    wanted = max(likely, min(sure, 1.0), CAUTION_LEAST)
    return min(ceil(100.0 * wanted) / 100.0, CAUTION_MAX)


def held_out(peaks: Sequence[FloatArray], false_alarms_per_hour: float) -> HeldOut | None:
    """Each dive judged by a threshold from all others; of a single one, each half by the other."""
    parts = list(peaks) if len(peaks) > 1 else [half for one in peaks for half in np.array_split(one, 2)]
    events, blocks = 0, 0
    for index, part in enumerate(parts):
        fitted = tail(np.concatenate([one for other, one in enumerate(parts) if other != index]))
        if fitted is not None:
            events += int((part >= caution_for(fitted, false_alarms_per_hour)).sum())
            blocks += len(part)
    return HeldOut(events, blocks * BLOCK_S / 3600.0) if blocks else None


def dive_peaks(thrusters: Sequence[LearntThruster], config: ThrusterConfig) -> list[FloatArray]:
    """By dive, the greatest score of any thruster in each block of its time, as of a detector with a caution of 1."""
    of_dive: dict[int, list[tuple[FloatArray, FloatArray]]] = {}
    for one in thrusters:
        for dive, scores in zip(one.dives, _scores(one, config), strict=True):
            of_dive.setdefault(id(dive), []).append(scores)
    return [
        block_maxima(*(np.concatenate(row) for row in zip(*several, strict=True)))[1] for several in of_dive.values()
    ]


def _scores(thruster: LearntThruster, config: ThrusterConfig) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Of each dive, times and scores of what was judged; a fault is a run of scores, so the least of such a run."""
    detector = ThrusterDetector(replace(config, caution=CAUTION_MAX, seed=config.seed + thruster.number))
    for samples, columns in zip(thruster.samples, successive(thruster.samples), strict=True):
        verdicts = detector.run(*columns)
        lasting = verdicts.score.copy()
        for back in range(1, CONFIRM):
            lasting[back:] = np.minimum(lasting[back:], verdicts.score[:-back])
        judged = verdicts.reason != "learning"
        yield samples.time_s[judged], CAUTION_MAX * lasting[judged]


def _quantities(found: Threshold) -> Iterator[Quantity]:
    fitted, caution = found.tail, found.caution
    rate = fitted.rate(caution)
    over = int((found.peaks >= caution).sum())
    reached = counted(over, fitted.hours)
    yield Quantity("caution", f"{caution:.2f}", f"a change of {caution * CHANGE_MIN[1]:.1%} is found at once")
    yield Quantity(
        "false alarms, foretold",
        f"{rate.per_hour:.2g} per hour",
        f"up to {rate.bound_per_hour:.2g}; by the tail of the peaks of {fitted.hours:.2f} h",
    )
    yield Quantity(
        "false alarms, reached",
        f"{over} in {fitted.hours:.2f} h",
        f"95 %: below {reached.bound_per_hour:.2g} per hour",
    )
    yield _told(found.held_out)


def _told(held_out: HeldOut | None) -> Quantity:
    name = "false alarms, held out"
    if held_out is None:
        return Quantity(name, "not known", "too short to judge one part by a threshold from another")
    return Quantity(
        name,
        f"{held_out.events} in {held_out.hours:.2f} h",
        f"95 %: below {held_out.rate.bound_per_hour:.2g} per hour; each part judged by the others' threshold",
    )
