"""A replay as a user asks for it: once, at several phases, against another configuration; and what comes of it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from gateway.commands.replay_bar import ReplayBar, clock
from gateway.config import Config, load
from gateway.findings import Finding
from gateway.replay.log_input import log_input
from gateway.replay.offsets import offsets_s
from gateway.report import PAGE, PICTURES
from gateway.severity import Severity

if TYPE_CHECKING:
    from gateway.replay.result import ReplayResult
    from gateway.replay.session import Terms
    from gateway.report.writing import Report

FINDINGS, SUMMARY, DIFF, PHASES = "findings.jsonl", "summary.txt", "diff.txt", "phases.txt"
# of the other configuration, and of the other phases
OTHERS = "others"


@dataclass(frozen=True, slots=True)
class Request:
    """What a user wants; the texts are as he has written them.

    Attributes:
        config: file of the configuration.
        logs: to judge.
        out: folder for what comes of it.
        offsets: of the clocks of logs.
        begin, end: what of the dive is told; None: all of it.
        detectors: that judge; none: all of them.
        phases: of the samples, at which it is judged.
        against: file of another configuration to compare with; None: there is none.
        report: whether a report is written; plots: its figures as pictures, too.
        least: severity of what is printed.
    """

    config: Path
    logs: tuple[str, ...]
    out: Path
    offsets: tuple[str, ...] = ()
    begin: str | None = None
    end: str | None = None
    detectors: tuple[str, ...] = ()
    phases: int = 1
    against: Path | None = None
    least: Severity = Severity.NOTICE
    report: bool = True
    plots: bool = False

    def __post_init__(self) -> None:
        if self.plots and not self.report:
            raise ValueError("--plots are the figures of the report: leave out --no-report")

    @property
    def words(self) -> list[str]:
        """The command that asks for the same, as a shell gets it: for what of it the report shows."""
        said = [("--from", self.begin), ("--to", self.end), *(("--detector", one) for one in self.detectors)]
        said += [("--offset", one) for one in self.offsets]
        options = [word for option, value in said if value is not None for word in (option, value)]
        return ["gateway", "replay", str(self.config), *self.logs, "--out", str(self.out), *options]


@dataclass(frozen=True, slots=True)
class Account:
    """What came of it.

    Attributes:
        lines: for people.
        faulty: whether faults were found.
        unusable: why nothing could be judged; empty where something was.
    """

    lines: list[str]
    faulty: bool
    unusable: str = ""


def replayed(request: Request, console: Console) -> Account:
    """Judges the logs, and writes what is found into the folder.

    Raises:
        OSError: something cannot be read or written.
        ValueError: what the user has asked for does not go together, or a log is not what its name says.
    """
    # with all detectors and log readers: no other command should wait for them
    from gateway.outlet import NOTES
    from gateway.report.writing import Report

    config, terms = load(request.config), _terms(request)
    other = None if request.against is None else load(request.against)
    _check(config, request)
    _clear(request.out)
    report = Report(config) if request.report else None
    with ReplayBar(console, request.least, NOTES) as bar:
        result = _judged(config, request, terms, request.out / FINDINGS, bar, report)
        drawn = _drawn(report, request, result, bar)
        unusable = _unusable(result, terms)
        compared = (
            []
            if unusable
            else [*_phases(config, request, terms, result, bar), *_diff(other, request, terms, result, bar)]
        )
    lines = [*result.lines(), *drawn]
    (request.out / SUMMARY).write_text("\n".join([*lines, "", *bar.told]) + "\n", encoding="utf-8")
    return Account([*lines, *compared], result.faulty, unusable)


def _terms(request: Request) -> Terms:
    from gateway.replay.session import DETECTORS, Terms
    from gateway.replay.window import Instant, Window

    begin, end = (None if text is None else Instant.of(text) for text in (request.begin, request.end))
    return Terms(Window(begin, end), frozenset(request.detectors) or DETECTORS)


def _check(config: Config, request: Request) -> None:
    """Whether there is something to watch for each detector asked for, and the findings of a run are left alone."""
    if config.files.findings.resolve() == (request.out / FINDINGS).resolve():
        raise ValueError(f"--out {request.out}: {FINDINGS} there is the gateway's own; name another folder")
    tables = {"thruster": config.thruster, "speed": config.speed, "navigation": config.navigation}
    for name in request.detectors:
        if not tables[name]:
            raise ValueError(f"--detector {name}: {request.config} has no [{name}] table, so there is none")


def _clear(out: Path) -> None:
    """Makes the folder; what an earlier replay left in it must not be taken for this one's."""
    out.mkdir(parents=True, exist_ok=True)
    for name in (SUMMARY, DIFF, PHASES, PAGE):
        (out / name).unlink(missing_ok=True)
    for suffix in (".png", ".svg"):
        for picture in (out / PICTURES).glob(f"*{suffix}"):
            picture.unlink()


def _judged(
    config: Config, request: Request, terms: Terms, findings: Path, bar: ReplayBar, report: Report | None = None
) -> ReplayResult:
    from gateway.replay.reels import reels
    from gateway.replay.session import Progress, replay

    def progress(place: Progress) -> None:
        if report is not None:
            report.take(place.findings)
        bar.show(place)

    inputs = [log_input(one, config.links()) for one in request.logs]
    several = reels(inputs, config, offsets_s(request.offsets, inputs))
    onlooker = None if report is None else report.onlooker
    return replay(config, several, findings, progress, jobs=os.cpu_count() or 1, onlooker=onlooker, terms=terms)


def _drawn(report: Report | None, request: Request, result: ReplayResult, bar: ReplayBar) -> list[str]:
    """Writes the report."""
    path = request.out / PAGE
    if report is None or result.told_from_s is None:
        return []
    report.write(result, request.out, request.words, pictures=request.plots, progress=bar.drawing)
    pictures = [f"plots: {request.out / PICTURES}"] if request.plots else []
    return [f"report: {path}", *pictures]


def _unusable(result: ReplayResult, terms: Terms) -> str:
    if result.begin_s is None:
        return "nothing in these logs is of a link of the configuration"
    if result.told_from_s is None:
        return f"the dive is {clock(result.duration_s)} long: nothing of it lies within --from and --to"
    if not result.judged:
        return "nothing could be judged: see what each needs in the configuration, and what these logs have"
    return ""


def _phases(config: Config, request: Request, terms: Terms, result: ReplayResult, bar: ReplayBar) -> list[str]:
    """What is found at some phases of the samples only."""
    from gateway.replay.comparison import agreements

    if request.phases == 1:
        return []
    several = [_findings(request.out / FINDINGS)]
    for number in range(1, request.phases):
        bar.begin(f"phase {number + 1} of {request.phases}", quiet=True)
        path = _other(request, f"phase_{number + 1}.jsonl")
        _judged(config, request, replace(terms, phase=number / request.phases), path, bar)
        several.append(_findings(path))
    found = [one for one in agreements(several) if one.finding.severity <= request.least]
    some = [one.line(request.phases, result.begin_s or 0.0, clock) for one in found if one.count < request.phases]
    all_agree = f"phases: {_count(len(found) - len(some))} at all {request.phases} phases of the samples"
    return _written(request.out / PHASES, [all_agree, *some])


def _diff(other: Config | None, request: Request, terms: Terms, result: ReplayResult, bar: ReplayBar) -> list[str]:
    """What another configuration would find."""
    from gateway.replay.comparison import SHIFT_MIN_S, compared

    if request.against is None or other is None:
        return []
    bar.begin(f"with {request.against.name}", quiet=True)
    path = _other(request, FINDINGS)
    _judged(other, request, terms, path, bar)
    pairs = [
        one
        for one in compared(_findings(request.out / FINDINGS), _findings(path))
        if min(found.severity for found in (one.here, one.there) if found is not None) <= request.least
    ]
    differ = [
        f"{clock(one.time_s - (result.begin_s or 0.0))} {one.line(request.against.name)}"
        for one in pairs
        if not one.alike
    ]
    alike = (
        f"against {request.against}: {_count(len(pairs) - len(differ))} alike to {SHIFT_MIN_S:g} s, {len(differ)} not"
    )
    return _written(request.out / DIFF, [alike, *differ])


def _other(request: Request, name: str) -> Path:
    folder = request.out / OTHERS
    folder.mkdir(exist_ok=True)
    return folder / name


def _count(findings: int) -> str:
    return f"{findings} finding{'' if findings == 1 else 's'}"


def _findings(path: Path) -> list[Finding]:
    return [Finding.of_json_line(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _written(path: Path, lines: Sequence[str]) -> list[str]:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return list(lines)
