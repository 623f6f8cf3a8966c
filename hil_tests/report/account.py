"""A play in lines of text: what was checked, what happened when, what was counted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter

from hil_tests.playback.outcome import Outcome
from hil_tests.report.commands import told
from hil_tests.report.expectations import checks
from hil_tests.report.modes import stretches
from hil_tests.report.wanted import severity_name
from hil_tests.report.windows import since_start_s
from hil_tests.report.words import clock


@dataclass(frozen=True, slots=True)
class Line:
    """Something that happened.

    Attributes:
        since_s: seconds since the start.
        kind: "fault", "finding", "STATUSTEXT", "command" or "mode".
        level: how bad it is: name of a level or a severity; "" = it is not rated.
        words: what.
    """

    since_s: float
    kind: str
    level: str
    words: str

    @property
    def clock(self) -> str:
        """When."""
        return clock(self.since_s)


def name_of(outcome: Outcome) -> str:
    """What a scenario is called."""
    return outcome.scenario.name or outcome.path.stem


def account(outcome: Outcome) -> Iterator[str]:
    """Checks; what happened in order of time; counters of the wires; the gateway's own account."""
    for check in checks(outcome):
        yield f"{'ok    ' if check.passed else 'MISSED'}  {check.expected}: {check.seen}"
    yield ""
    for line in happenings(outcome):
        yield f"{line.clock:>9}  {line.kind:10} {line.level:8} {line.words}"
    yield ""
    for wire, counts in outcome.wire_counts.items():
        yield f"{wire}: {counted(counts)}"
    yield from outcome.gateway_lines


def counted(counts: Mapping[str, int]) -> str:
    """What faults did on a wire."""
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "nothing was changed"


def happenings(outcome: Outcome) -> list[Line]:
    """Faults, findings, texts, commands and modes, in order of time."""
    return sorted(_happenings(outcome), key=attrgetter("since_s"))


def _happenings(outcome: Outcome) -> Iterator[Line]:
    for fault in outcome.scenario.faults:
        yield Line(fault.at_s, "fault", "", f"{fault.words} begins")
        if fault.until_s <= outcome.end_s - outcome.start_s:
            yield Line(fault.until_s, "fault", "", f"{fault.words} ends")
    for stretch in stretches(outcome):
        yield Line(stretch.from_s, "mode", "", stretch.words)
    for finding in outcome.findings:
        since_s = since_start_s(outcome, finding.time_s)
        yield Line(since_s, "finding", finding.level.name, f"{finding.subject}: {finding.text}")
    for text in outcome.texts:
        yield Line(since_start_s(outcome, text.time_s), "STATUSTEXT", severity_name(text.severity), text.text)
    for command in outcome.commands:
        yield Line(since_start_s(outcome, command.time_s), "command", "", told(command))
