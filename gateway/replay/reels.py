"""Logs of all kinds to what is replayed in one piece each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from gateway.config import Config
from gateway.recording.entries import About
from gateway.recording.reading import read_about
from gateway.replay.clocks import on_one_clock
from gateway.replay.grouping import grouped
from gateway.replay.log_input import LogInput, LogKind
from gateway.replay.recorded_run import RecordedRun
from gateway.replay.reel import MergedLogs, Reel


def reels(
    logs: Sequence[LogInput], config: Config, given_s: Mapping[Path, float] = MappingProxyType({})
) -> list[Reel]:
    """Recordings of ours run by run, each as it was. All else is on one time line, and so are recordings that are
    beside other logs, or of which one link is wanted.

    Args:
        logs: in any order.
        config: whose links they are of.
        given_s: by log, what is to be added to its times.

    Raises:
        OSError: a log cannot be read.
        ValueError: logs that do not go together, or that the configuration has no link for.
    """
    if given_s or any(log.kind is not LogKind.RECORDING or log.link for log in logs):
        return [MergedLogs(on_one_clock(grouped(logs, config, given_s), config, given_s))]
    abouts = {log.path: read_about(log.path) for log in logs}
    return [RecordedRun(parts, config) for parts in runs_of(abouts)]


def runs_of(abouts: Mapping[Path, About]) -> Iterator[list[tuple[Path, About]]]:
    """Parts that follow each other, in the order of time; one that is there twice counts once. Behind one that is
    missing, another reel begins.
    """
    parts: list[tuple[Path, About]] = []
    for path, about in sorted(abouts.items(), key=lambda one: (one[1].started_s, one[1].run, one[1].part)):
        before = parts[-1][1] if parts else about
        if parts and (before.run, before.part) == (about.run, about.part):
            continue
        if parts and (before.run, before.part + 1) != (about.run, about.part):
            yield parts
            parts = []
        parts.append((path, about))
    if parts:
        yield parts
