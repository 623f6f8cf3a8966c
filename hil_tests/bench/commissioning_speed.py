"""Normal speeds as `gateway commission` learns them, beside the true ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np

from gateway.commissioning.speed_learning import MissingError, learn
from hil_tests.bench.speed_detection import samples
from hil_tests.bench.speed_ways import RECORDED, RECORDING_NOISE_M
from hil_tests.missions import Passage, Style, carried, random_mission
from hil_tests.processes import results

NEVER_S = 1e9


@dataclass(frozen=True, slots=True)
class LearntSpeed:
    """On one healthy way.

    Attributes:
        group: of the way.
        error: of the learnt speed against the mean true one, as a share of that; NaN: the way was refused.
        claimed: standard deviation that commissioning says.
    """

    group: str
    error: float
    claimed: float


@dataclass(frozen=True, slots=True)
class SpeedRow:
    """A group of ways.

    Attributes:
        group: its name. ways: number. refused: those that taught too little.
        median, greatest: of the errors' size. claimed: median. within: share within twice what was claimed.
    """

    group: str
    ways: int
    refused: int
    median: float
    greatest: float
    claimed: float
    within: float


def learnt_speed(group: str, way: Passage) -> LearntSpeed:
    """Learns from one way, without any command."""
    try:
        found = learn([samples(way)])
    except MissingError:
        return LearntSpeed(group, nan, nan)
    true_mps = float(way.true_speed_mps.mean())
    return LearntSpeed(group, float(found.fit.speed_mps[0]) / true_mps - 1.0, found.error)


def of_mission(seed: int, style: Style) -> LearntSpeed:
    """On the healthy mission of a seed."""
    way = random_mission(seed, 0.0, style)
    return learnt_speed(f"missions, {way.drawn['water']} current", way)


def of_recording(name: str, path: Path) -> LearntSpeed:
    """On a recording of `RECORDED`, with a current put into it."""
    kind = RECORDED[name]
    way = carried(
        kind.read(path), "constant", kind.flow_mps, noise_m=RECORDING_NOISE_M, seed=0, loss=0.0, onset_s=NEVER_S
    )
    return learnt_speed(name, way)


def judge_speeds(pool: ProcessPoolExecutor, missions: int, style: Style, folder: Path) -> list[SpeedRow]:
    """All missions and recordings that are there."""
    futures = [pool.submit(of_mission, seed, style) for seed in range(missions)]
    futures += _recorded(pool, folder)
    found = results(futures, "speeds")
    groups = dict.fromkeys(sorted(one.group for one in found))
    return [row_of(group, [one for one in found if one.group == group]) for group in groups]


def _recorded(pool: ProcessPoolExecutor, folder: Path) -> Iterator[Future[LearntSpeed]]:
    for name, kind in RECORDED.items():
        for path in sorted(folder.glob(kind.pattern)):
            yield pool.submit(of_recording, name, path)


def row_of(group: str, found: Sequence[LearntSpeed]) -> SpeedRow:
    """Sums up one group."""
    known = [one for one in found if np.isfinite(one.error)]
    if not known:
        return SpeedRow(group, len(found), len(found), nan, nan, nan, nan)
    errors, claimed = np.abs([one.error for one in known]), np.array([one.claimed for one in known])
    return SpeedRow(
        group=group,
        ways=len(found),
        refused=len(found) - len(known),
        median=float(np.median(errors)),
        greatest=float(errors.max()),
        claimed=float(np.median(claimed)),
        within=float(np.mean(errors <= 2.0 * claimed)),
    )
