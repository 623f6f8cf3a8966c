"""Work spread over processes, and a bar that shows how far it is."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

# Libraries of linear algebra start a thread per core, for matrices that are far too small for it; the runs are what
# is spread over the cores. Read when numpy is loaded, hence set before the processes start.
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1")
T = TypeVar("T")


@contextmanager
def processes(jobs: int, niceness: int = 0) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes, each with one thread for linear algebra; they end with what they do, interrupted at once.

    Args:
        jobs: how many.
        niceness: the higher, the more they leave the processors to others.
    """
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    others = set(active_children())
    try:
        with ProcessPoolExecutor(jobs, get_context("spawn"), os.nice, (niceness,)) as pool:
            try:
                yield pool
            except KeyboardInterrupt:
                for process in set(active_children()) - others:
                    process.terminate()
                raise
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def results(futures: Sequence[Future[T]], what: str) -> list[T]:
    """Of all, in their order, under a progress bar; after an error no more work is begun."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        try:
            for future in progress.track(as_completed(futures), total=len(futures), description=what):
                future.result()
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return [future.result() for future in futures]
