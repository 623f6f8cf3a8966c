"""The figures of the navigation benchmark as files."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from detectors.navigation import NavigationConfig
from hil_tests.bench.navigation_cases import CASES, PAPER_CASE, Case, Source, onsets
from hil_tests.bench.navigation_measure import Options
from hil_tests.bench.navigation_positions import FAULTS
from hil_tests.bench.navigation_trace import MakeWatch, initial_of, seed_of
from hil_tests.navigation_figures import Watched, statistics_figure, track_figure
from hil_tests.navigation_trials import Way, faulty, play, samples
from hil_tests.processes import results

PICTURED: tuple[Case, ...] = (CASES[0], PAPER_CASE)  # a step, a drift
DPI = 110


def watched(source: Source, case: Case, config: NavigationConfig, make: MakeWatch) -> Watched:
    """A dive with a fault along the hull, on a straight leg where there is one.

    Raises:
        ValueError: the dive is too short for a fault.
    """
    data = source.load()
    rng = np.random.default_rng(seed_of(source))
    begins = onsets(data, rng)
    if not begins:
        raise ValueError(f"{source.name}: too short: want more seconds, to put a fault into it")
    onset_s = begins.get("straight", begins.get("turn", 0.0))
    fault = replace(case.fault(onset_s, rng), axis=0)
    watch = make(replace(config, isolate=False), initial_of(source, data))
    record = play(watch, samples(faulty(data, [fault])))
    return Watched(f"{case.name} at {onset_s:.0f} s ({source.name})", fault, record)


def draw(
    folder: Path, pool: ProcessPoolExecutor, options: Options, make: MakeWatch, ways: Sequence[Way]
) -> list[Path]:
    """Writes `statistics.png` and `track.png`, of the first dive each, as far as there is one."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {}
    sources: list[Source] = [*options.recorded, *options.simulated]
    if sources:
        futures = [pool.submit(watched, sources[0], case, options.config(sources[0]), make) for case in PICTURED]
        figures["statistics.png"] = statistics_figure(results(futures, "figures"))
    if ways:
        spans_s = [(onset_s, end_s) for _, _, onset_s, end_s in FAULTS]
        figures["track.png"] = track_figure([one for one in ways if one.dive == ways[0].dive], spans_s)
    for name, figure in figures.items():
        figure.savefig(folder / name, dpi=DPI)
    return [folder / name for name in figures]
