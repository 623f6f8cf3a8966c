"""How often healthy dives exceed which likelihood ratio: what the default method's threshold is set by.

    python -m hil_tests.navigation_thresholds --runs 100

The greatest ratios of healthy dives follow an exponential law in their tail (peaks over a level: the excesses of
independent peaks have one mean, whatever the level). Its two numbers go into `detectors.navigation.thresholds`: the
ratio that is exceeded once an hour, and by how much more one is that is exceeded e times more seldom. They are fitted
on one half of the dives, and the rate that follows from them is counted on the other half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationConfig, NavigationDetector
from detectors.navigation.thresholds import ratio_threshold
from hil_tests.bench.navigation_cases import Recorded, Simulated, Source
from hil_tests.bench.navigation_measure import RECORDINGS
from hil_tests.bench.navigation_trace import initial_of
from hil_tests.navigation_trials import play, samples
from hil_tests.processes import processes, results

FloatArray = NDArray[np.float64]

APART_S = 60.0  # the ratio remembers so long: peaks closer than this are one
LEVEL_PER_HOUR = 10.0  # the tail begins where it is exceeded so often


@dataclass(frozen=True, slots=True, eq=False)
class Healthy:
    """The ratio in one healthy dive.

    Attributes:
        name: of the dive. hours: its length. peaks: (P,) greatest values, `APART_S` and more from each other.
    """

    name: str
    hours: float
    peaks: FloatArray


@dataclass(frozen=True, slots=True)
class Tail:
    """An exponential law: rate of exceedance = exp((once_an_hour - ratio) / per_e_fold) an hour.

    Attributes:
        once_an_hour: ratio that is exceeded so often. per_e_fold: by how much more for an e-th of it.
        peaks: number of them that it is fitted to.
    """

    once_an_hour: float
    per_e_fold: float
    peaks: int

    def per_hour(self, ratio: float) -> float:
        """How often a ratio is exceeded."""
        return exp((self.once_an_hour - ratio) / self.per_e_fold)


def peaks_of(time_s: FloatArray, values: FloatArray, apart_s: float = APART_S) -> FloatArray:
    """(P,) the greatest value, the greatest so far away from it, and so on."""
    left, found = np.isfinite(values), []
    while left.any():
        index = int(np.argmax(np.where(left, values, -np.inf)))
        found.append(values[index])
        left &= np.abs(time_s - time_s[index]) >= apart_s
    return np.array(found)


def tail_of(dives: Sequence[Healthy], level_per_hour: float = LEVEL_PER_HOUR) -> Tail:
    """The law that fits best.

    Raises:
        ValueError: too few peaks.
    """
    hours = sum(dive.hours for dive in dives)
    peaks = np.sort(np.concatenate([dive.peaks for dive in dives]))[::-1]
    count = round(level_per_hour * hours)
    if not 5 <= count < len(peaks):
        raise ValueError(f"{len(peaks)} peaks in {hours:.2f} h: want more than {max(count, 5)}: more dives")
    level = float(peaks[count])
    per_e_fold = float(np.mean(peaks[:count] - level))
    return Tail(level + per_e_fold * log(count / hours), per_e_fold, count)


def healthy(source: Source) -> Healthy:
    """Plays one dive, without isolation."""
    data, config = source.load(), NavigationConfig(isolate=False)
    record = play(NavigationDetector(config, initial_of(source, data)), samples(data))
    ratios = record.statistics["ratio"] * ratio_threshold(config.false_alarms_per_hour)
    return Healthy(source.name, float(np.ptp(data.imu[:, 0])) / 3600.0, peaks_of(record.time_s, ratios))


def report(name: str, dives: Sequence[Healthy]) -> str:
    """The law of all, and how one half keeps what the other promises."""
    whole, promised = tail_of(dives), tail_of(dives[::2])
    hours = sum(dive.hours for dive in dives)
    lines = [
        f"{name}: {len(dives)} dives, {hours:.2f} h: once an hour {whole.once_an_hour:.1f}, "
        f"{whole.per_e_fold:.2f} for each e-fold ({whole.peaks} peaks)"
    ]
    others = dives[1::2]
    for wanted in (4.0, 2.0, 1.0):
        ratio = promised.once_an_hour - promised.per_e_fold * log(wanted)
        events = sum(int((dive.peaks > ratio).sum()) for dive in others)
        counted = events / sum(dive.hours for dive in others)
        lines.append(f"  wanted {wanted:g} / h: counted on the other half {counted:.2f} / h ({events})")
    greatest = max(dives, key=lambda dive: dive.peaks[0])
    lines.append(f"  greatest: {greatest.peaks[0]:.1f} in {greatest.name}")
    return "\n".join(lines)


@click.command()
@click.option("--runs", type=click.IntRange(min=0), default=40, show_default=True, help="Random dives.")
@click.option("--seed", type=click.IntRange(min=0), default=1000, show_default=True, help="Of the first.")
@click.option("--rough", is_flag=True, help="Rough dives.")
@click.option("--recordings", type=click.Path(path_type=Path, file_okay=False), default=RECORDINGS, help="Folder.")
@click.option("--jobs", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
def main(*, runs: int, seed: int, rough: bool, recordings: Path, jobs: int) -> None:
    """Fit the tail of the likelihood ratio in healthy dives, and count what comes of it."""
    groups: dict[str, list[Source]] = {
        "recordings": [Recorded(path) for path in sorted(recordings.glob("*.npz"))],
        "random dives": [Simulated(seed + number, "rough" if rough else "plain") for number in range(runs)],
    }
    with processes(jobs) as pool:
        for name, sources in groups.items():
            if sources:
                click.echo(report(name, results([pool.submit(healthy, source) for source in sources], name)))


if __name__ == "__main__":
    main()
