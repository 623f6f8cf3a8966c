"""A play in lines of text: what was checked, what happened when, what was counted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter

from gateway.outlet import NOTES
from gateway.plotting.clock import clock
from gateway.report.subjects import calm_subjects
from hil_tests.report.commands import acts, told
from hil_tests.report.expectations import checks
from hil_tests.report.modes import stretches
from hil_tests.report.outcome import Outcome
from hil_tests.report.wanted import severity_name
from hil_tests.report.windows import since_start_s


@dataclass(frozen=True, slots=True)
class Line:
    """Something that happened.

    Attributes:
        since_s: seconds since the start.
        kind: "fault", "finding", "STATUSTEXT", "command" or "mode".
        level: how bad it is: name of a level or a severity; "" = it is not rated.
        words: what.
        calm: whether it is a finding of something that was never worse than NORMAL.
    """

    since_s: float
    kind: str
    level: str
    words: str
    calm: bool = False

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
    lines = happenings(outcome)
    for line in lines:
        if not line.calm:
            yield f"{line.clock:>9}  {line.kind:10} {line.level:8} {line.words}"
    yield f"findings of what was never worse than NORMAL: {sum(line.calm for line in lines)}"
    yield ""
    for wire, counts in outcome.wire_counts.items():
        yield f"{wire}: {counted(counts)}"
    yield from outcome.gateway_lines


def counted(counts: Mapping[str, int]) -> str:
    """What faults did on a wire."""
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "nothing was changed"


def happenings(outcome: Outcome) -> list[Line]:
    """Faults, findings, texts, modes, and commands that act on the vehicle, in order of time."""
    return sorted(_happenings(outcome), key=attrgetter("since_s"))


def _happenings(outcome: Outcome) -> Iterator[Line]:
    for fault in outcome.scenario.faults:
        yield Line(fault.at_s, "fault", "", f"{fault.words} begins")
        if fault.until_s <= outcome.end_s - outcome.start_s:
            yield Line(fault.until_s, "fault", "", f"{fault.words} ends")
    for stretch in stretches(outcome):
        yield Line(stretch.from_s, "mode", "", stretch.words)
    calm = calm_subjects(outcome.findings)
    for finding in outcome.findings:
        since_s, words = since_start_s(outcome, finding.time_s), f"{finding.subject}: {finding.text}"
        is_calm = finding.detector not in NOTES and finding.subject in calm
        yield Line(since_s, "finding", finding.level.name, words, is_calm)
    for text in outcome.texts:
        yield Line(since_start_s(outcome, text.time_s), "STATUSTEXT", severity_name(text.severity), text.text)
    for command in filter(acts, outcome.commands):
        yield Line(since_start_s(outcome, command.time_s), "command", "", told(command))
