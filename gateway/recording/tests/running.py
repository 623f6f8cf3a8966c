"""Recorders that run, for tests."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gateway.config_sections import Recording
from gateway.recording.entries import Entry
from gateway.recording.folder import recordings
from gateway.recording.recorder import Recorder
from gateway.recording.tests.dive import START_S, about, read

WITHIN_S = 10.0


def settings(folder: Path, **keys: float) -> Recording:
    return Recording(**({"folder": folder, "keep_free_mb": 0.0} | keys))


def until(happened: Callable[[], bool]) -> None:
    end_s = time.monotonic() + WITHIN_S
    while not happened():
        assert time.monotonic() < end_s
        time.sleep(0.02)


@contextmanager
def recording(folder: Path, **keys: float) -> Iterator[Recorder]:
    """A recorder that runs."""
    recorder = Recorder(settings(folder, **keys), about(), lambda: START_S)
    recorder.begin()
    try:
        yield recorder
    finally:
        assert recorder.close(WITHIN_S)


def all_of(folder: Path) -> list[Entry]:
    return [entry for one in recordings(folder) for entry in read(one.path)[0]]
