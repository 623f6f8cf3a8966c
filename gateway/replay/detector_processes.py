"""Thruster detectors in processes of their own: most of a replay's time is theirs, and none needs another.

A block that is handed over is judged while the next detector gets its own; who looks at the verdicts waits for them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count, cycle
from multiprocessing import get_context
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from detectors.thruster import LearntCurve, ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.detector import ThrusterVerdicts
from detectors.thruster.wear import CommissionedCurve
from gateway.process_signals import sigint_blocked
from gateway.thruster_channel import ThrusterFactory

END_S = 5.0
Work = Callable[[dict[int, ThrusterDetector]], Any]


def _serve(connection: Connection) -> None:
    """In the process: does one piece of work after the other with its detectors, until there is no more."""
    detectors: dict[int, ThrusterDetector] = {}
    waiting: SimpleQueue[Work | None] = SimpleQueue()
    # what comes is always read: else both sides could wait for the other to read what they send
    Thread(target=_receive, args=(connection, waiting), daemon=True).start()
    with threadpool_limits(limits=1, user_api="blas"), suppress(BrokenPipeError):
        while (work := waiting.get()) is not None:
            connection.send(_done(work, detectors))


def _receive(connection: Connection, waiting: SimpleQueue[Work | None]) -> None:
    work: Work | None = None
    with suppress(EOFError, OSError):
        while (work := connection.recv()) is not None:
            waiting.put(work)
    waiting.put(None)


def _done(work: Work, detectors: dict[int, ThrusterDetector]) -> tuple[Any, Exception | None]:
    try:
        return work(detectors), None
    except Exception as error:  # it is raised where the answer is wanted
        return None, error


def _make(
    detectors: dict[int, ThrusterDetector], key: int, config: ThrusterConfig, commissioned: CommissionedCurve | None
) -> None:
    detectors[key] = ThrusterDetector(config, commissioned)


def _run(detectors: dict[int, ThrusterDetector], key: int, columns: tuple[Any, ...]) -> ThrusterVerdicts:
    return detectors[key].run(*columns)


def _commissioned(detectors: dict[int, ThrusterDetector], key: int) -> CommissionedCurve | None:
    return detectors[key].commissioned


def _learnt(detectors: dict[int, ThrusterDetector], key: int) -> LearntCurve | None:
    return detectors[key].learnt


def _accept(detectors: dict[int, ThrusterDetector], key: int) -> None:
    detectors[key].accept()


class _Answer:
    """What comes of a piece of work, once it is there."""

    def __init__(self, worker: _Worker) -> None:
        self._worker = worker
        self._answer: tuple[Any, Exception | None] | None = None

    def put(self, answer: tuple[Any, Exception | None]) -> None:
        self._answer = answer

    def value(self) -> Any:
        while self._answer is None:
            self._worker.receive()
        value, error = self._answer
        if error is not None:
            raise error
        return value


@contextmanager
def _alive() -> Iterator[None]:
    try:
        yield
    except (EOFError, OSError) as error:
        raise ChildProcessError("a process of detectors has ended; was there enough memory?") from error


class _Worker:
    """A process, from outside. Answers come in the order of the work."""

    def __init__(self) -> None:
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        with sigint_blocked():
            self._process.start()
        theirs.close()
        self._awaited: deque[_Answer] = deque()

    def ask(self, work: Work) -> _Answer:
        answer = _Answer(self)
        self._awaited.append(answer)
        with _alive():
            self._connection.send(work)
        return answer

    def receive(self) -> None:
        with _alive():
            answer = self._connection.recv()
        self._awaited.popleft().put(answer)

    def close(self) -> None:
        with suppress(OSError):
            self._connection.send(None)
        self._connection.close()
        self._process.join(END_S)
        self._process.kill()
        self._process.join()


class _Verdicts:
    """Verdicts of a block, which are waited for when somebody looks at them."""

    def __init__(self, answer: _Answer) -> None:
        self._answer = answer

    @property
    def level(self) -> NDArray[np.int64]:
        """(N,) of `Level`."""
        return self.whole.level

    def row(self, index: int) -> ThrusterVerdict:
        """One of them."""
        return self.whole.row(index)

    @property
    def whole(self) -> ThrusterVerdicts:
        """All of them."""
        value: ThrusterVerdicts = self._answer.value()
        return value


class _Detector:
    """A detector in another process; see `gateway.thruster_channel.Detector`."""

    def __init__(
        self, worker: _Worker, key: int, config: ThrusterConfig, commissioned: CommissionedCurve | None
    ) -> None:
        self._worker, self._key = worker, key
        worker.ask(partial(_make, key=key, config=config, commissioned=commissioned))

    @property
    def commissioned(self) -> CommissionedCurve | None:
        """The curve that wear is measured against."""
        curve: CommissionedCurve | None = self._worker.ask(partial(_commissioned, key=self._key)).value()
        return curve

    @property
    def learnt(self) -> LearntCurve | None:
        """The steady curve as it is learnt by now."""
        curve: LearntCurve | None = self._worker.ask(partial(_learnt, key=self._key)).value()
        return curve

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """Judges one sample."""
        columns = (sample.time_s, sample.command, sample.speed_rpm, sample.voltage_v, sample.current_a)
        return self.run(*(np.array([np.nan if one is None else one]) for one in columns)).row(0)

    def run(
        self,
        time_s: ArrayLike,
        command: ArrayLike,
        speed_rpm: ArrayLike,
        voltage_v: ArrayLike | None = None,
        current_a: ArrayLike | None = None,
    ) -> _Verdicts:
        """Has a block judged."""
        columns = (time_s, command, speed_rpm, voltage_v, current_a)
        return _Verdicts(self._worker.ask(partial(_run, key=self._key, columns=columns)))

    def accept(self) -> None:
        """Makes today's curve the commissioned one."""
        self._worker.ask(partial(_accept, key=self._key))

    def resume(self) -> None:
        """A replay begins with detectors that know nothing."""


@contextmanager
def detector_processes(jobs: int) -> Iterator[ThrusterFactory]:
    """What makes thruster detectors, spread over so many processes, which end with this."""
    workers = [_Worker() for _ in range(jobs)]
    turn, keys = cycle(workers), count()

    def make(config: ThrusterConfig, commissioned: CommissionedCurve | None) -> _Detector:
        return _Detector(next(turn), next(keys), config, commissioned)

    try:
        yield make
    finally:
        for worker in workers:
            worker.close()
