"""Detection: who finds a lasting loss of speed on random runs, how soon, and who cries wolf."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from time import perf_counter

import numpy as np

from detectors.thruster import ThrusterDetector, ThrusterSample
from detectors.thruster.paper import FixedPolynomial, OnlinePolynomial
from detectors.verdict import Level
from hil_tests.bench import peers
from hil_tests.random_runs import RandomRun, Style, random_run

LOSSES = {0.0: 0, 0.07: 20, 0.03: 100}  # relative loss, and the samples within which it is to be found


@dataclass(frozen=True, slots=True)
class Contender:
    """A detector on random runs.

    Attributes:
        name: in the table.
        first_alarm: first sample of a run with an alarm, None for none.
        package: that it needs beyond the project's own dependencies; empty for none.
    """

    name: str
    first_alarm: Callable[[RandomRun], int | None]
    package: str = ""

    @property
    def available(self) -> bool:
        """Whether its package is installed."""
        return not self.package or find_spec(self.package) is not None


def ours(run: RandomRun) -> int | None:
    """The thruster detector with its defaults: first FAULT."""
    verdicts = ThrusterDetector().run(run.time_s, run.command, run.speed_rpm)
    return _first(verdicts.level == Level.FAULT)


def fixed_model(run: RandomRun) -> int | None:
    """Paper 000's comparison, with its windows and warm-up, an automatic threshold and exact search."""
    return _first_fault(FixedPolynomial(search="exact"), run)


def paper_rule(run: RandomRun) -> int | None:
    """Paper 000's online rule, likewise. Its search is exact: the optimum that its swarm looks for, in less time."""
    return _first_fault(OnlinePolynomial(search="exact"), run)


CONTENDERS = {
    contender.name: contender
    for contender in (
        Contender("thruster detector", ours),
        Contender("fixed model", fixed_model),
        Contender("paper's rule", paper_rule),
        Contender("PageHinkley", peers.page_hinkley, "river"),
        Contender("ADWIN", peers.adwin, "river"),
        Contender("HalfSpaceTrees", peers.half_space_trees, "river"),
        Contender("isolation forest", peers.isolation_forest, "pyod"),
        Contender("ECOD", peers.ecod, "pyod"),
    )
}


@dataclass(frozen=True, slots=True)
class Finding:
    """What one contender made of one run.

    Attributes:
        contender, seed, loss: which.
        delay: samples from the first one that shows the loss to the first alarm, negative for an earlier, false one;
            None for no alarm. In a healthy run every alarm is false.
        seconds: that it took for the run.
    """

    contender: str
    seed: int
    loss: float
    delay: int | None
    seconds: float


@dataclass(frozen=True, slots=True)
class Score:
    """A contender over all runs.

    Attributes:
        contender: its name.
        runs: healthy runs, and as many with each loss.
        healthy_alarms: healthy runs with an alarm.
        found_7, found_3: runs whose 7 % loss was found within 20 samples, 3 % within 100, without an earlier alarm.
        early_7: runs with an alarm before the 7 % loss.
        median_delay_7: median samples to an alarm that was not early; None for none.
        seconds_per_run: mean.
    """

    contender: str
    runs: int
    healthy_alarms: int
    found_7: int
    early_7: int
    found_3: int
    median_delay_7: float | None
    seconds_per_run: float


def judge(contender: str, seed: int, style: Style) -> list[Finding]:
    """One contender on the healthy and the faulty runs of one seed."""
    return [_judge(CONTENDERS[contender], random_run(seed, loss, style)) for loss in LOSSES]


def score(contender: str, findings: Sequence[Finding]) -> Score:
    """Sum the findings of one contender up."""
    own = [finding for finding in findings if finding.contender == contender]
    delays = {loss: [finding.delay for finding in own if finding.loss == loss] for loss in LOSSES}
    known = [delay for delay in delays[0.07] if delay is not None]
    late = [delay for delay in known if delay >= 0]
    return Score(
        contender=contender,
        runs=len(delays[0.0]),
        healthy_alarms=sum(delay is not None for delay in delays[0.0]),
        found_7=_in_time(delays[0.07], LOSSES[0.07]),
        early_7=len(known) - len(late),
        found_3=_in_time(delays[0.03], LOSSES[0.03]),
        median_delay_7=float(np.median(late)) if late else None,
        seconds_per_run=float(np.mean([finding.seconds for finding in own])),
    )


def _judge(contender: Contender, run: RandomRun) -> Finding:
    begin = perf_counter()
    alarm = contender.first_alarm(run)
    seconds = perf_counter() - begin
    return Finding(contender.name, run.seed, run.loss, None if alarm is None else alarm - run.onset, seconds)


def _in_time(delays: Sequence[int | None], limit: int) -> int:
    return sum(delay is not None and 0 <= delay <= limit for delay in delays)


def _first_fault(rule: FixedPolynomial | OnlinePolynomial, run: RandomRun) -> int | None:
    """Judges the whole run, as the others do: the seconds are of all its samples."""
    samples = map(ThrusterSample, run.time_s.tolist(), run.command.tolist(), run.speed_rpm.tolist())
    return _first(np.array([rule.step(sample).level == Level.FAULT for sample in samples]))


def _first(alarm: np.ndarray) -> int | None:
    samples = np.flatnonzero(alarm)
    return int(samples[0]) if len(samples) else None
