"""What a demonstration shows while it runs: a live table in a terminal, lines of text elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, degrees, hypot, isfinite
from typing import Protocol

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from detectors.navigation import NavigationVerdict, Sensor
from detectors.speed.sample import SpeedVerdict
from detectors.verdict import Level
from hil_tests.demo.record import SENSORS, Happening, Judged, JudgedNavigation, JudgedSpeed
from hil_tests.demo.summary import Summary, summary_lines

STYLES = {Level.UNKNOWN: "dim", Level.NORMAL: "green", Level.SUSPECT: "bold yellow", Level.FAULT: "bold white on red"}
LOG_LINES = 12
# Together within a terminal of 80 characters; the widest level is "FAULT propeller lost".
COLUMNS = {"": 3, "command": 7, "RPM": 6, "predicted": 9, "residual": 8, "limit": 5, "level": 20}
SPEED_COLUMNS = {"speed, m/s": 11, "normal": 9, "flow": 14, "level": 30}
NAVIGATION_COLUMNS = {"innovation, m/s": 15, "evidence": 8} | dict.fromkeys(SENSORS, 9)
PLAIN_EVERY_S = 5.0


@dataclass(frozen=True, slots=True)
class View:
    """Everything that is shown at one instant; times in seconds since the start, except within `judged`.

    Attributes:
        since_s: time since the start.
        lasts_s: how long the whole takes.
        start_s: what `since_s` counts from.
        mode: the autopilot's mode.
        voltage_v: of the battery.
        judged: newest sample and verdict by thruster.
        speed: newest sample and verdict of the vehicle's speed; None before the first.
        navigation: of the navigation sensors; None before the first.
        happenings: all so far, in order of time.
    """

    since_s: float
    lasts_s: float
    start_s: float
    mode: str
    voltage_v: float
    judged: dict[int, Judged]
    speed: JudgedSpeed | None
    navigation: JudgedNavigation | None
    happenings: Sequence[Happening]


class Display(Protocol):
    """Something that shows views, one after the other, between `__enter__` and `__exit__`."""

    def __enter__(self) -> Display: ...

    def __exit__(self, *ignored: object) -> None: ...

    def show(self, view: View) -> None:
        """Show this instant."""


class LiveDisplay:
    """A table that is redrawn in place."""

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, auto_refresh=False)

    def __enter__(self) -> LiveDisplay:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def show(self, view: View) -> None:
        """Redraw."""
        tables = thruster_table(view), speed_table(view), navigation_table(view)
        self._live.update(Group(heading(view), *tables, log(view)), refresh=True)


class PlainDisplay:
    """Lines of text: every happening once, and every few seconds how all thrusters are."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._shown: set[Happening] = set()
        self._next_s = 0.0

    def __enter__(self) -> PlainDisplay:
        return self

    def __exit__(self, *_: object) -> None:
        return

    def show(self, view: View) -> None:
        """Print what is new."""
        for happening in view.happenings:
            if happening not in self._shown:
                self._shown.add(happening)
                self._print(happening.time_s - view.start_s, happening.text)
        if view.since_s >= self._next_s:
            self._next_s += PLAIN_EVERY_S
            self._print(view.since_s, _levels(view))

    def _print(self, since_s: float, text: str) -> None:
        self._console.print(f"{since_s:7.2f} s  {text}", markup=False, highlight=False, soft_wrap=True)


def heading(view: View) -> Text:
    """Time, mode and battery."""
    return Text(
        f"gateway demo  {view.since_s:5.1f} of {view.lasts_s:.0f} s   autopilot in {view.mode}   "
        f"battery {view.voltage_v:.1f} V",
        style="bold",
    )


def thruster_table(view: View) -> Table:
    """One row a thruster."""
    table = Table(expand=False)
    for column, width in COLUMNS.items():
        table.add_column(column, width=width, justify="left" if column == "level" else "right", no_wrap=True)
    for thruster, one in view.judged.items():
        table.add_row(f"T{thruster}", *_numbers(one), _level(one))
    return table


def speed_table(view: View) -> Table:
    """The vehicle's speed through the water."""
    table = Table(expand=False)
    for column, width in SPEED_COLUMNS.items():
        table.add_column(column, width=width, justify="left" if column == "level" else "right", no_wrap=True)
    if view.speed is not None:
        verdict = view.speed.verdict
        words = f"{verdict.level.name} {verdict.reason}".rstrip()
        table.add_row(*_speeds(verdict), Text(words, style=STYLES[verdict.level]))
    return table


def navigation_table(view: View) -> Table:
    """What the navigation sensors are worth; evidence of 1 is a fault."""
    table = Table(expand=False)
    for column, width in NAVIGATION_COLUMNS.items():
        table.add_column(column, width=width, justify="left" if column in SENSORS else "right", no_wrap=True)
    if view.navigation is not None:
        verdict = view.navigation.verdict
        levels = (verdict.of(sensor).level for sensor in SENSORS.values())
        table.add_row(*_evidence(verdict), *(Text(level.name, style=STYLES[level]) for level in levels))
    return table


def log(view: View) -> RenderableType:
    """The newest happenings, as the autopilot received them."""
    lines = [Text("at the autopilot:", style="bold")]
    for happening in view.happenings[-LOG_LINES:]:
        style = "bold red" if happening.alarm else ""
        lines.append(Text(f"{happening.time_s - view.start_s:7.2f} s  {happening.text}", style=style))
    return Group(*lines)


def closing_table(summary: Summary, start_s: float) -> Table:
    """What came of it."""
    table = Table(title="summary", show_header=False)
    table.add_column("what", justify="right")
    table.add_column("value")
    for what, value in summary_lines(summary, start_s):
        table.add_row(what, value)
    return table


def _numbers(one: Judged) -> tuple[str, ...]:
    verdict = one.verdict
    predicted, residual, threshold = (
        f"{value:.0f}" if isfinite(value) else "-"
        for value in (verdict.predicted_rpm, verdict.residual_rpm, verdict.threshold_rpm)
    )
    return f"{100.0 * one.sample.command:+.0f} %", f"{one.sample.speed_rpm:.0f}", predicted, residual, threshold


def _level(one: Judged) -> Text:
    words = [one.verdict.level.name, str(one.verdict.kind), "" if one.verdict.kind else one.verdict.reason]
    return Text(" ".join(word for word in words if word), style=STYLES[one.verdict.level])


def _levels(view: View) -> str:
    thrusters = "  ".join(f"T{thruster} {one.verdict.level.name}" for thruster, one in view.judged.items())
    parts = [thrusters or "no thruster heard yet"]
    if view.speed is not None:
        speed, normal, flow = _speeds(view.speed.verdict)
        parts.append(f"speed {view.speed.verdict.level.name} {speed} m/s of {normal}, flow {flow}")
    if view.navigation is not None:
        parts.append(_navigation_words(view.navigation.verdict))
    return "  ".join(parts)


def _navigation_words(verdict: NavigationVerdict) -> str:
    innovation, evidence = _evidence(verdict)
    isolated = f", isolated: {', '.join(verdict.isolated)}" if verdict.isolated else ""
    return f"DVL {verdict.of(Sensor.DVL).level.name} off by {innovation} m/s, evidence {evidence}{isolated}"


def _evidence(verdict: NavigationVerdict) -> tuple[str, str]:
    """How far the DVL is off what is expected, forward and right, and the worst sensor's evidence."""
    ahead_mps, right_mps = verdict.innovation[:2]
    known = isfinite(ahead_mps) and isfinite(right_mps)
    return f"{ahead_mps:+.2f} {right_mps:+.2f}" if known else "-", f"{verdict.score:.2f}"


def _speeds(verdict: SpeedVerdict) -> tuple[str, str, str]:
    """Speed, normal speed and flow, "-" where not known."""
    limits = (verdict.speed_min_mps, verdict.speed_max_mps)
    normal = "{:.2f}-{:.2f}".format(*limits) if all(map(isfinite, limits)) else "-"
    return f"{verdict.speed_mps:.2f}" if isfinite(verdict.speed_mps) else "-", normal, flow_words(verdict.flow_mps)


def flow_words(flow_mps: Sequence[float]) -> str:
    """A flow, north and east, by its speed and where it sets to: "0.40 m/s @ 085"."""
    north_mps, east_mps = flow_mps[:2]
    if not (isfinite(north_mps) and isfinite(east_mps)):
        return "-"
    return f"{hypot(north_mps, east_mps):.2f} m/s @ {round(degrees(atan2(east_mps, north_mps))) % 360:03d}"
