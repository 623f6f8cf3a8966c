"""All dives judged, spread over processes, and summed up by method and by fault."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

from detectors.navigation import NavigationConfig
from detectors.navigation.config import MethodName
from hil_tests.bench.navigation_cases import CASES, PAPER_CASE, Case, Recorded, Simulated, Source
from hil_tests.bench.navigation_paper import PaperScore, paper_score, paper_trace
from hil_tests.bench.navigation_positions import DURATION_S, variants, way
from hil_tests.bench.navigation_scores import DEFAULT, Alarms, Found, alarms, by_case, found, scales_for
from hil_tests.bench.navigation_trace import PLAIN, Job, MakeWatch, Trace, traces
from hil_tests.dives import IMU_HZ, Style
from hil_tests.navigation_trials import Way
from hil_tests.processes import results

PUBLISHED = ("chi_square", "cusum")  # those that need nothing but a filter
METHODS: tuple[MethodName, ...] = get_args(MethodName)
RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "snapir"
SLOW_HZ = (50.0, 25.0, 10.0)
SLOW_NAMES = ("DVL step 1 m/s", PAPER_CASE.name, "gyro step 0.02 rad/s")
SLOW_CASES = tuple(case for case in CASES if case.name in SLOW_NAMES)


@dataclass(frozen=True, slots=True)
class Options:
    """What is measured.

    Attributes:
        runs: random dives. first_seed, style: of them.
        recordings: folder; what is not there is left out.
        only: methods beside the default; none: all.
        plain: the published methods on the paper's own filter, too.
        both: each fault on a straight leg and in a turn; else the one or the other.
        slow: with slower IMUs as well.
        folds: folder of LSTMs, NAME.npz not having seen the recording NAME.npz; None: the one that ships.
        positions: dives of 1000 s with a DVL that fails five times.
    """

    runs: int = 4
    first_seed: int = 0
    style: Style = "plain"
    recordings: Path = RECORDINGS
    only: tuple[MethodName, ...] = ()
    plain: bool = True
    both: bool = False
    slow: bool = True
    folds: Path | None = None
    positions: int = 2

    @property
    def methods(self) -> tuple[MethodName, ...]:
        """Those to be compared, the default last."""
        return (*(name for name in (self.only or METHODS) if name != "ratio"), "ratio")

    @property
    def compared(self) -> tuple[str, ...]:
        """Names of their statistics, those on the paper's filter first."""
        published = [f"{PLAIN}{name}" for name in self.methods if name in PUBLISHED]
        return (*(published if self.plain else ()), *self.methods)

    @property
    def recorded(self) -> list[Recorded]:
        """The recordings that are there."""
        return [Recorded(path) for path in sorted(self.recordings.glob("*.npz"))]

    @property
    def simulated(self) -> list[Simulated]:
        """The random dives."""
        return [Simulated(seed, self.style) for seed in range(self.first_seed, self.first_seed + self.runs)]

    def config(self, source: Source) -> NavigationConfig:
        """Of the detector, with the LSTM that has not seen this dive."""
        model = self.folds / f"{source.name}.npz" if self.folds is not None and isinstance(source, Recorded) else None
        return NavigationConfig(lstm_model=model, compare="lstm" in self.methods)


@dataclass(frozen=True, slots=True)
class Group:
    """What was found on one set of dives.

    Attributes:
        name: of it.
        healthy: false alarms of each method, as it stands, and at the default's rate.
        found: each case and method at that rate. own: at the methods' own thresholds.
        straight, turning: the default's, by where the fault began.
        ms_per_s: mean time for a second of data.
    """

    name: str
    healthy: list[Alarms]
    found: list[Found]
    own: list[Found]
    straight: list[Found]
    turning: list[Found]
    ms_per_s: float


@dataclass(frozen=True, slots=True)
class Rate:
    """The default method with a slower IMU.

    Attributes:
        imu_hz: its rate. healthy: false alarms. found: of some cases.
    """

    imu_hz: float
    healthy: Alarms
    found: list[Found]


def judge_all(pool: ProcessPoolExecutor, options: Options, make: MakeWatch) -> list[Trace]:
    """Every recording and every dive, healthy and with each fault."""
    sources: list[Source] = [*options.recorded, *options.simulated]
    return _judge(pool, options, make, sources, CASES, "dives", plain=options.plain)


def judge_slow(pool: ProcessPoolExecutor, options: Options, make: MakeWatch) -> dict[float, list[Trace]]:
    """The recordings with slower IMUs, by their rate."""
    if not options.slow:
        return {}
    return {
        imu_hz: _judge(
            pool,
            options,
            make,
            [replace(one, imu_hz=imu_hz) for one in options.recorded],
            SLOW_CASES,
            f"{imu_hz:g} Hz",
        )
        for imu_hz in SLOW_HZ
        if options.recorded
    }


def judge_paper(
    pool: ProcessPoolExecutor, options: Options, make: MakeWatch, judged: Sequence[Trace]
) -> list[PaperScore]:
    """The paper's protocol on the recordings: without isolation, by each method's own threshold and by the one at the
    default's rate of false alarms; and with it."""
    recorded = options.recorded
    if not recorded:
        return []
    using_all, isolating = _paper_futures(pool, options, make)
    scales = scales_by_method(options, [one for one in judged if one.group == recorded[0].group])
    seen = results(using_all, "paper 003")
    scores = [paper_score(name, seen) for name in options.compared]
    scores += [paper_score(name, seen, scales[name]) for name in options.compared]
    return scores + [paper_score(name, results(one, "paper 003")) for name, one in isolating.items()]


def _paper_futures(
    pool: ProcessPoolExecutor, options: Options, make: MakeWatch
) -> tuple[list[Future[Trace]], dict[MethodName, list[Future[Trace]]]]:
    """Of all methods without isolation, and with it, by the method that isolates."""
    configs = [(source, options.config(source)) for source in options.recorded]
    using_all = [
        pool.submit(paper_trace, source, replace(config, isolate=False), make, options.plain)
        for source, config in configs
    ]
    isolating = {
        name: [pool.submit(paper_trace, source, replace(config, method=name), make) for source, config in configs]
        for name in options.methods
    }
    return using_all, isolating


def judge_positions(pool: ProcessPoolExecutor, options: Options, make: MakeWatch) -> list[Way]:
    """Dives of 1000 s with a DVL that fails five times, in each variant."""
    sources = [
        Simulated(options.first_seed + number, options.style, duration_s=DURATION_S, vehicle="auv")
        for number in range(options.positions)
    ]
    kinds = variants(NavigationConfig(), options.methods)
    futures = [pool.submit(way, source, kind, make) for kind in kinds for source in sources]
    return results(futures, "positions")


def scales_by_method(options: Options, judged: Sequence[Trace]) -> dict[str, dict[str, float]]:
    """For each method and each dive, the threshold at the rate of false alarms that the default really has: the
    default's too, which its own is not tuned down to."""
    healthy = _healthy(judged, isolate=False)
    wanted = alarms(DEFAULT, _healthy(judged, isolate=True)).per_hour
    return {name: scales_for(name, healthy, wanted) for name in options.compared}


def group_of(name: str, options: Options, judged: Sequence[Trace]) -> Group:
    """One set of dives, summed up."""
    scales = scales_by_method(options, judged)
    plain, isolating = _healthy(judged, isolate=False), _healthy(judged, isolate=True)
    own_alarms = [alarms(one, isolating if one == DEFAULT else plain) for one in options.compared]
    cases = by_case(judged)
    return Group(
        name=name,
        healthy=[*own_alarms, *(alarms(one, plain, scales[one]) for one in scales)],
        found=[found(one, trials, scales[one]) for trials in cases.values() for one in options.compared],
        own=[found(one, trials) for trials in cases.values() for one in options.compared],
        straight=_where(cases, "straight"),
        turning=_where(cases, "turn"),
        ms_per_s=1e3 * sum(one.seconds for one in isolating) / sum(one.data_s for one in isolating),
    )


def rates_of(options: Options, judged: Sequence[Trace], slow: dict[float, list[Trace]]) -> list[Rate]:
    """The default method by the IMU's rate, the full one first."""
    recorded = [one for one in judged if options.recorded and one.group == options.recorded[0].group]
    every = {IMU_HZ: recorded, **slow} if slow and recorded else {}
    return [
        Rate(
            imu_hz,
            alarms(DEFAULT, _healthy(traces_, isolate=True)),
            [found(DEFAULT, trials) for name, trials in by_case(traces_).items() if name in SLOW_NAMES],
        )
        for imu_hz, traces_ in every.items()
    ]


def _judge(
    pool: ProcessPoolExecutor,
    options: Options,
    make: MakeWatch,
    sources: Sequence[Source],
    cases: tuple[Case, ...],
    what: str,
    *,
    plain: bool = False,
) -> list[Trace]:
    futures = [
        pool.submit(traces, Job(source, cases, options.config(source), make, options.both, number, plain))
        for number, source in enumerate(sources)
    ]
    return [trace for found_ in results(futures, what) for trace in found_]


def _healthy(judged: Sequence[Trace], *, isolate: bool) -> list[Trace]:
    return [one for one in judged if one.case is None and one.isolate is isolate]


def _where(cases: dict[str, list[Trace]], where: str) -> list[Found]:
    parts = {name: [one for one in trials if one.where == where] for name, trials in cases.items()}
    return [found(DEFAULT, trials, where=where) for trials in parts.values() if trials]
