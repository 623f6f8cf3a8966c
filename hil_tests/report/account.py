"""A play in lines of text: what was checked, what happened when, what was counted."""

from __future__ import annotations

from collections.abc import Iterator

from hil_tests.playback.outcome import Outcome
from hil_tests.report.commands import told
from hil_tests.report.expectations import checks
from hil_tests.report.modes import stretches
from hil_tests.report.wanted import severity_name
from hil_tests.report.windows import since_start_s
from hil_tests.report.words import clock


def account(outcome: Outcome) -> Iterator[str]:
    """Checks; faults, findings, texts, commands and modes in order of time; counters; the gateway's own account."""
    for check in checks(outcome):
        yield f"{'ok    ' if check.passed else 'MISSED'}  {check.expected}: {check.seen}"
    yield ""
    for since_s, line in sorted(_happenings(outcome)):
        yield f"{clock(since_s):>9}  {line}"
    yield ""
    for wire, counts in outcome.wire_counts.items():
        yield f"{wire}: {', '.join(f'{name} {count}' for name, count in counts.items()) or 'nothing changed'}"
    yield from outcome.gateway_lines


def _happenings(outcome: Outcome) -> Iterator[tuple[float, str]]:
    for fault in outcome.scenario.faults:
        yield fault.at_s, f"fault      {fault.words}"
    for finding in outcome.findings:
        since_s = since_start_s(outcome, finding.time_s)
        yield since_s, f"finding    {finding.level.name} of {finding.subject}: {finding.text}"
    for text in outcome.texts:
        yield since_start_s(outcome, text.time_s), f'STATUSTEXT {severity_name(text.severity)} "{text.text}"'
    for command in outcome.commands:
        yield since_start_s(outcome, command.time_s), f"command    {told(command)}"
    for stretch in stretches(outcome):
        yield stretch.from_s, f"mode       {stretch.words}"
