"""What is replayed in one piece."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from drivers.logs.damage import DamageReport
from gateway.findings import Finding
from gateway.pipeline import Pipeline
from gateway.replay.clocks import TimedLog
from gateway.replay.merging import stretches
from gateway.replay.result import ReplayResult, told
from gateway.stretches.stretch import BlockArrival


class Reel(Protocol):
    """What one pipeline judges from beginning to end."""

    def begin(self, pipeline: Pipeline) -> None:
        """Gives a new pipeline what was known when it began."""
        ...

    def __iter__(self) -> Iterator[list[BlockArrival]]:
        """The readings in stretches of time, in order.

        Raises:
            OSError: a log cannot be read.
            ValueError: a log is not what its name says, or two logs are of one link.
        """
        ...

    def share(self) -> float:
        """How much of it was read by now, of its bytes."""
        ...

    def account(self, result: ReplayResult, found: Sequence[Finding] | None) -> None:
        """At the end: what was read, and what was lost.

        `found`: all that was found in it; None: not all of it was judged.
        """
        ...


class MergedLogs:
    """Logs side by side, as one reel.

    Args:
        logs: on one clock, see `gateway.replay.clocks`.
    """

    def __init__(self, logs: Sequence[TimedLog]) -> None:
        self._logs = tuple(logs)

    def begin(self, pipeline: Pipeline) -> None:
        """See `Reel`: nothing was known."""

    def __iter__(self) -> Iterator[list[BlockArrival]]:
        """See `Reel`."""
        return stretches(self._logs)

    def share(self) -> float:
        """See `Reel`."""
        return share_of({path: one for log in self._logs for path, one in log.readings.damage.items()})

    def account(self, result: ReplayResult, found: Sequence[Finding] | None) -> None:
        """See `Reel`."""
        for one in self._logs:
            result.add_drops(one.readings.drops())
            result.unused += one.readings.unused
            for path, damage in one.readings.damage.items():
                clock = [f"clock {one.remark}"] if one.remark else []
                set_back = [told(step) for step in one.readings.set_back.get(path, ())]
                result.add_log(path, damage, [*clock, *set_back])


def share_of(logs: Mapping[Path, DamageReport]) -> float:
    """How much of some files was read, of their bytes; nothing of those that are gone."""
    sizes = [path.stat().st_size for path in logs if path.exists()]
    return min(sum(one.bytes_read for one in logs.values()) / max(sum(sizes), 1), 1.0)
