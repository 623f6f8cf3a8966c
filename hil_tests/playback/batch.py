"""Many scenarios, several at a time: in virtual time each core plays one."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway.process_signals import sigint_blocked
from hil_tests.processes import processes
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.loading import load_scenario

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Job:
    """A scenario to play in virtual time.

    Attributes:
        path: of its file.
        folder: for all that is written.
        changes: fields that are set anew.
    """

    path: Path
    folder: Path
    changes: Mapping[str, Any]


def play_jobs(
    jobs: Sequence[Job], at_a_time: int, done: Callable[[Outcome], None], niceness: int = 0
) -> list[Outcome]:
    """Plays all of them, each in virtual time.

    Args:
        jobs: what to play.
        at_a_time: processes that play; 1: this one.
        done: hears of each as it comes to its end.
        niceness: the higher, the more those processes leave the processors to others.

    Returns:
        What came of them, in the order of the jobs.

    Raises:
        Exception: what a play has raised; no more are begun then.
        KeyboardInterrupt: those that are being played end at once.
    """
    if at_a_time == 1 or len(jobs) == 1:
        return [_told(_play(job), done) for job in jobs]
    with processes(min(at_a_time, len(jobs)), niceness) as pool:
        with sigint_blocked():  # it comes to all of a terminal: who plays is ended by us
            futures = [pool.submit(_play, job) for job in jobs]
        _tell(futures, done)
        return [future.result() for future in futures]


def _tell(futures: Sequence[Future[Outcome]], done: Callable[[Outcome], None]) -> None:
    try:
        for future in as_completed(futures):
            done(future.result())
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def _play(job: Job) -> Outcome:
    """Plays it; one that cannot be played is no reason not to play the others."""
    from hil_tests.playback.play import play_file

    try:
        return play_file(job.path, job.folder, changes=job.changes)
    except Exception as error:  # also of what nobody has thought of: the others' reports must not be lost for it
        log.debug("%s", job.path, exc_info=error)
        return Outcome(
            scenario=load_scenario(job.path),
            path=job.path,
            way="not played",
            start_s=0.0,
            end_s=0.0,
            wall_s=0.0,
            broken=str(error) if isinstance(error, OSError | ValueError) else f"{type(error).__name__}: {error}",
            folder=job.folder,
        )


def _told(outcome: Outcome, done: Callable[[Outcome], None]) -> Outcome:
    done(outcome)
    return outcome
