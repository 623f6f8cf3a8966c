"""The report of a dive: one HTML file that needs no network, and no script but for its figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from shlex import join

from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.plotting.clock import clock, lasting
from gateway.plotting.figure import Figure
from gateway.plotting.pages import Drawings, Place, environment
from gateway.replay.result import UNIX_SINCE_S, instant
from gateway.report.dive import Dive
from gateway.report.found import as_one, headline, name_of, troubles, watched
from gateway.report.subjects import calm_subjects
from gateway.summary import listed

TEMPLATES = Path(__file__).parent / "templates"
# how many of what was found stand above all else
SHOWN_MAX = 8
# and how many findings are told one by one: no phone shows more
LINES_MAX = 1000
MINUTE_S = 60.0
# parts of the page, by what the names of their figures begin with
PARTS = (
    ("", ("timeline",)),
    ("Thrusters", ("thruster",)),
    ("Speed and flow", ("speed", "track", "flow")),
    ("Navigation sensors", ("navigation",)),
    ("Links and buses", ("link",)),
)


@dataclass(frozen=True, slots=True)
class Part:
    """Figures of one kind: those that are drawn, and those that wait until they are asked for."""

    title: str
    main: Sequence[Place]
    more: Sequence[Place]


@dataclass(frozen=True, slots=True)
class Line:
    """Something that happened. `calm`: of something that was never worse than NORMAL."""

    clock: str
    name: str
    level: str
    text: str
    calm: bool


def write_page(dive: Dive, figures: Sequence[Figure], again: Sequence[str], path: Path) -> None:
    """Write the file.

    Args:
        dive: what it is about.
        figures: of it.
        again: the command that replays it once more, in words as a shell gets them.
        path: of the file; one that is there is replaced.

    Raises:
        OSError: it cannot be written.
    """
    text = page(dive, figures, again)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError:
        with suppress(OSError):
            path.unlink()  # half a page would open, and show nothing
        raise


def page(dive: Dive, figures: Sequence[Figure], again: Sequence[str]) -> str:
    """The page; see `write_page`. The same dive gives the same page."""
    drawings = Drawings.of(figures)
    title, mood = headline(dive)
    found, lines = as_one(troubles(dive)), list(_lines(dive))
    loud, calm = ([line for line in lines if line.calm is is_calm] for is_calm in (False, True))
    return (
        environment(TEMPLATES)
        .get_template("report.html")
        .render(
            vehicle=dive.config.vehicle.name,
            headline=title,
            mood=mood,
            begun=instant(dive.begin_s),
            length=_spell(dive.result.duration_s),
            told_from=clock(round(dive.from_s, 1)) if dive.from_s else "",
            at=_instants(dive),
            found=found[:SHOWN_MAX],
            others=found[SHOWN_MAX:],
            watched=watched(dive),
            parts=list(_parts(drawings.places)),
            drawings=drawings.packed,
            loud=loud[:LINES_MAX],
            calm=calm[:LINES_MAX],
            left_out=len(loud[LINES_MAX:]) + len(calm[LINES_MAX:]),
            read=dive.result.logs,
            lost=list(_lost(dive)),
            remarks={name_of(subject, dive): text for subject, text in dive.result.remarks.items()},
            versions=dive.versions,
            config=dive.config_text,
            again=join(again),
            spell=_spell,
        )
    )


def _instants(dive: Dive) -> Callable[[float], str]:
    """Since the beginning, and by the clock on the wall where the log knows it."""

    def at(since_s: float) -> str:
        since = clock(round(since_s, 1))
        return since if dive.begin_s < UNIX_SINCE_S else f"{since} ({instant(dive.begin_s + since_s)[11:]})"

    return at


def _spell(seconds: float) -> str:
    """A stretch of time: "16.1 s", "12 min 30 s", "2 h 5 min"."""
    if seconds < MINUTE_S:
        return lasting(round(seconds, 1))
    minutes, second = divmod(round(seconds), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours} h {minute} min" if hours else f"{minute} min {second} s"


def _parts(places: Sequence[Place]) -> Iterator[Part]:
    for title, names in PARTS:
        own = [place for place in places if place.name.startswith(names)]
        if own:
            yield Part(title, [one for one in own if one.main], [one for one in own if not one.main])


def _lines(dive: Dive) -> Iterator[Line]:
    calm = calm_subjects(dive.findings)
    for one in sorted(dive.findings, key=lambda one: one.time_s):
        note = one.detector in NOTES
        yield Line(
            clock(round(one.time_s - dive.begin_s, 1)),
            _whose(one, dive),
            "" if note else one.level.name,
            one.text,
            not note and one.subject in calm,
        )


def _whose(finding: Finding, dive: Dive) -> str:
    return name_of(finding.detector if finding.detector in NOTES else finding.subject, dive)


def _lost(dive: Dive) -> Iterator[tuple[str, str]]:
    """Where, and what by which cause."""
    for place, causes in dive.result.drops.items():
        if causes:
            yield place, listed(causes)
    for interface, count in dive.result.unused.items():
        yield interface, f"{count} frames that no link of the configuration is for"
    for link in dive.links:
        lost = float(link.lost.sum())
        if lost:
            yield link.name, f"{lost:.0f} frames lost before they were received"
        if len(link.down):
            total_s = float((link.down[:, 1] - link.down[:, 0]).sum())
            first = clock(round(float(link.down[0, 0]), 1))
            times = "once, at" if len(link.down) == 1 else f"{len(link.down)} times, first at"
            yield link.name, f"down {times} {first}, for {_spell(total_s)}"
