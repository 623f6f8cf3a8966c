"""Which logs go on one another, and which are of the same time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from gateway.config import Config
from gateway.replay.log_input import LogInput
from gateway.replay.log_readings import LogReadings

_Begun = tuple[LogInput, frozenset[str], float]  # its links, and when it begins


def grouped(
    logs: Sequence[LogInput], config: Config, given_s: Mapping[Path, float] = MappingProxyType({})
) -> list[LogReadings]:
    """Logs of the same links follow each other, in the order of their times; others are side by side.

    Args:
        logs: in any order.
        config: whose links they are of.
        given_s: by log, what is to be added to its times.

    Raises:
        OSError: a log cannot be read.
        ValueError: the configuration has no link that a log could be of, or two logs of a link do not go together.
    """
    if len(logs) == 1:
        return [LogReadings(logs, config)]
    several = [(log, *LogReadings([log], config).beginning()) for log in logs]
    groups: list[list[_Begun]] = []
    for one in sorted(several, key=lambda begun: begun[2]):
        group = next((group for group in groups if any(one[1] & other[1] for other in group)), None)
        if group is None:
            groups.append([one])
            continue
        _check(group[0], one, given_s)
        group.append(one)
    return [LogReadings([log for log, *_ in group], config) for group in groups]


def _check(first: _Begun, other: _Begun, given_s: Mapping[Path, float]) -> None:
    """Whether two logs of a link are of one kind and clock."""
    both = f"{first[0].path} and {other[0].path} are both of {', '.join(sorted(first[1] & other[1]))}"
    if first[0].kind is not other[0].kind:
        raise ValueError(f"{both}: replay one of them")
    if given_s.get(first[0].path) != given_s.get(other[0].path):
        raise ValueError(f"{both}: give both the same --offset, or replay one of them")
