"""The report of a run: one HTML file that needs no network, and no script but for its figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from shlex import join

from gateway.plotting.clock import clock, lasting
from gateway.plotting.pages import Drawings, Place, environment
from hil_tests.report.account import Line, counted, happenings, name_of
from hil_tests.report.check import Check
from hil_tests.report.expectations import checks, found_after_s
from hil_tests.report.figures import figures
from hil_tests.report.outcome import Outcome
from hil_tests.report.table import summary
from hil_tests.scenario.fault import AXES, Fault

# In a play's folder: the gateway's configuration, and the packets that it heard; logs of the buses are beside them.
CONFIG, HEARD = "gateway.toml", "heard.tlog"


@dataclass(frozen=True, slots=True)
class FaultRow:
    """A fault in words."""

    words: str
    from_clock: str
    to_clock: str
    ramp: str
    size: str


@dataclass(frozen=True, slots=True)
class Section:
    """What the page tells of one scenario.

    Attributes:
        outcome: of it.
        name: for people.
        passed: whether all checks did.
        checks: all of them.
        found_after: of the first thing that was to be found, "" = nothing was, or it was not.
        played_s: how long it was, in the time of the dive.
        speed: how many times faster than real time.
        faults: of it.
        lines: what happened, in order of time.
        places: of the plots, in the order of `drawings`.
        drawings: of the plots, packed.
        again: commands that play it once more, and that replay what the gateway heard.
    """

    outcome: Outcome
    name: str
    passed: bool
    checks: Sequence[Check]
    found_after: str
    played_s: float
    speed: str
    faults: Sequence[FaultRow]
    lines: Sequence[Line]
    places: Sequence[Place]
    drawings: str
    again: Sequence[str]


def write_report(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the file.

    Raises:
        OSError: it cannot be written.
    """
    path.write_text(report_html(outcomes, datetime.now(UTC)), encoding="utf-8")


def report_html(outcomes: Sequence[Outcome], written: datetime) -> str:
    """The page: what failed comes first, else as it was played.

    Args:
        outcomes: of the run.
        written: when; aware of its time zone.
    """
    sections = sorted((_section(outcome) for outcome in outcomes), key=lambda one: one.passed)
    passed = sum(one.passed for one in sections)
    template = environment(Path(__file__).parent).get_template("report.html")
    return template.render(
        sections=sections,
        alone=len(sections) == 1,
        summary=summary(passed, len(sections)),
        all_passed=passed == len(sections),
        played_s=round(sum(one.played_s for one in sections)),
        wall_s=round(sum(outcome.wall_s for outcome in outcomes)),
        written=written.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        clock=clock,
        lasting=lasting,
        counted=counted,
    )


def _section(outcome: Outcome) -> Section:
    held, found_s = checks(outcome), found_after_s(outcome)
    drawings = Drawings.of(figures(outcome, held))
    return Section(
        outcome=outcome,
        name=name_of(outcome),
        passed=all(one.passed for one in held),
        checks=held,
        found_after="" if found_s is None else lasting(found_s),
        played_s=round(outcome.end_s - outcome.start_s, 1),
        speed=_speed(outcome),
        faults=list(_fault_rows(outcome)),
        lines=list(happenings(outcome)),
        places=[replace(one, name="") for one in drawings.places],  # a name is an id, of one thing on a page
        drawings=drawings.packed,
        again=list(_again(outcome)),
    )


def _again(outcome: Outcome) -> Iterator[str]:
    yield join(["gateway", "hil", "play", outcome.path.as_posix(), "--seed", str(outcome.scenario.seed)])
    folder = outcome.folder
    if folder is None:
        return
    logs = [
        path for path in (*sorted(folder.glob("*.log")), folder / HEARD) if path.is_file() and path.stat().st_size
    ]
    if logs:
        files = [path.as_posix() for path in (folder / CONFIG, *logs)]
        yield join(["gateway", "replay", *files, "--out", (folder / "replay").as_posix()])


def _speed(outcome: Outcome) -> str:
    if outcome.wall_s <= 0.0:
        return ""
    times = (outcome.end_s - outcome.start_s) / outcome.wall_s
    return f"{times:.0f}×" if times >= 10.0 else f"{times:.1f}×"


def _fault_rows(outcome: Outcome) -> Iterator[FaultRow]:
    for fault in outcome.scenario.faults:
        to_clock = clock(fault.until_s) if isfinite(fault.until_s) else "the end"
        ramp = lasting(fault.ramp_s) if fault.ramp_s else "at once"
        yield FaultRow(fault.words, clock(fault.at_s), to_clock, ramp, ", ".join(_size(fault)))


def _size(fault: Fault) -> Iterator[str]:
    if fault.axis is not None:
        yield AXES[fault.axis]
    for name, value in fault.values.items():
        yield f"{name.replace('_', ' ')} {value:g}"
