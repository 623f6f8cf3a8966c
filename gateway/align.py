"""Joins what arrives unevenly, at different rates and from different buses, into evenly spaced thruster samples.

Commands (a PWM value in MAVLink, a RawCommand on CAN) and reports (RPM, voltage, current) of one thruster come with
their own jitter. A detector wants samples that are evenly spaced, so for each thruster, with `period = 1 / rate`:

- **Grid.** Sample `k` stands at `t_k = (k + phase) * period`, counted from the epoch, so its place does not depend on
  when the program was started. The phase is 0, but where a replay asks what another would have changed.
- **Command.** The mean over `(t_{k-1}, t_k]` of the command, each held until the next one arrives: a change inside a
  period counts in proportion. That is what the motor has felt, and it keeps the timing of a step that the grid cuts.
- **Speed.** Linear between the two reports around `t_k`. The sample is therefore given out when the later one comes,
  at most one report behind the present.
- **Voltage, current.** The last one reported before `t_k`, for up to `TELEMETRY_HOLD_S`, then None.
- **Gap.** Two successive reports more than `gap_s` apart: nothing is made up between them, the next sample just comes
  later, and the detector sees the jump in time.
- **Staleness.** No sample where the newest command is older than `stale_s`, nor where commands do not cover the whole
  period: what the motor was told is then not known.
- **Slow commands.** Where commands are a stream at a rate that others can change (MAVLink's), one that is older than
  twice their usual interval is stale, too: others who share the link set the rate down (ground stations ask for
  all their streams at once), and what the motor was told half a second ago does not explain its speed now. Less often
  than every `usual_interval.RARE_S` they explain nothing at all.
- **Rate.** As configured, or learnt from the first `RATE_REPORTS` intervals of the reports: the largest of `RATES_HZ`
  that is not above 1.1 times the median rate of the reports, nor of the commands. (A command that is told 20 times a
  second is known to 50 ms, and finer samples would only show that as an error of the thruster's timing. Commands that
  come less than 10 times a second count as 10: those may be sent on change only, and are exact.) While learning, no
  samples. Once known the rate stays: a learnt delay in samples would lose its meaning with another period.
- **Time running backwards.** A command older than the last one, or a report not newer than the last one, is refused
  and counted in `drops`; so is a value that is not finite. Nothing here raises on data.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from detectors.thruster.sample import ThrusterSample
from gateway.usual_interval import UsualInterval

RATES_HZ = (1, 2, 4, 5, 10, 20, 25, 40, 50, 100, 200)
RATE_REPORTS = 50
RATE_TOLERANCE = 1.1
COMMAND_RATE_MIN_HZ = 10.0

# ArduPilot's own limit for ESC telemetry other than RPM (AP_ESC_Telem: RPM 1 s, the rest 5 s)
TELEMETRY_HOLD_S = 5.0

# beyond this a time stamp is garbage (the year 5138), and the number of its grid point no longer exact
TIME_LIMIT_S = 1e11


def nearest_rate_hz(report_rate_hz: float) -> float:
    """The largest of `RATES_HZ` that is not above 1.1 times the report rate; the smallest where all are above."""
    fitting = [rate for rate in RATES_HZ if rate <= RATE_TOLERANCE * report_rate_hz]
    return float(fitting[-1] if fitting else RATES_HZ[0])


def is_time(time_s: float) -> bool:
    """False for what cannot be a time stamp, in seconds: NaN, infinity, or thousands of years away."""
    return abs(time_s) < TIME_LIMIT_S


class Point(NamedTuple):
    """A value at an instant."""

    time_s: float
    value: float


class HeldCommand:
    """A command that holds until the next one: its mean over an interval, for as far back as is needed."""

    def __init__(self, stale_s: float, keep_s: float) -> None:
        self.stale_s = stale_s
        self.keep_s = keep_s
        self._points: deque[Point] = deque()

    @property
    def points(self) -> Sequence[Point]:
        """What is remembered, oldest first; no two neighbours are further apart than `stale_s`."""
        return self._points

    def replace(self, points: Iterable[Point]) -> None:
        """Remembers these instead."""
        self._points = deque(points)

    def append(self, time_s: float, value: float) -> float | None:
        """Takes the newest command; seconds since the one before, None and nothing changed where it is older."""
        interval_s = time_s - self._points[-1].time_s if self._points else 0.0
        if interval_s < 0.0:
            return None
        if interval_s > self.stale_s:
            self._points.clear()  # what was told in between is not known
        points = self._points
        points.append(Point(time_s, value))
        oldest_s = time_s - self.keep_s
        while len(points) > 1 and points[1].time_s <= oldest_s:  # as `forget_before`, for every command
            points.popleft()
        return interval_s

    def mean(self, start_s: float, end_s: float) -> float | None:
        """Mean over `(start_s, end_s]`; None where the interval is not covered or the command is stale at its end."""
        points = self._within(start_s, end_s)
        if not points or points[0].time_s > start_s or end_s - points[-1].time_s > self.stale_s:
            return None
        held = points[-1].value
        # integral of (command - the command held at the end): exactly 0 for a constant command, whatever the rounding
        total = 0.0
        for earlier, later in pairwise(points):
            total += (earlier.value - held) * (later.time_s - max(earlier.time_s, start_s))
        return held + total / (end_s - start_s)

    def _within(self, start_s: float, end_s: float) -> list[Point]:
        """From the one that holds at the start, where it is remembered, to the one that holds at the end."""
        within: list[Point] = []
        for point in reversed(self._points):
            if point.time_s <= end_s:
                within.append(point)
                if point.time_s <= start_s:
                    break
        within.reverse()
        return within

    def forget_before(self, time_s: float) -> None:
        """Drops what no interval that starts at `time_s` or later needs."""
        while len(self._points) > 1 and self._points[1].time_s <= time_s:
            self._points.popleft()


class RateLearner:
    """The sample rate that suits reports and commands, from the medians of their first intervals."""

    def __init__(self) -> None:
        self._commands_s: list[float] = []
        self._reports_s: list[float] = []

    def command(self, interval_s: float) -> None:
        """Takes the interval between two commands, in seconds."""
        self._commands_s.append(interval_s)

    def report(self, interval_s: float) -> float | None:
        """Takes the interval between two reports; the rate in Hz once there were enough of them, else None."""
        self._reports_s.append(interval_s)
        if len(self._reports_s) < RATE_REPORTS:
            return None
        return nearest_rate_hz(1.0 / max(median(self._reports_s), self._command_interval_s()))

    def _command_interval_s(self) -> float:
        return min(median(self._commands_s), 1.0 / COMMAND_RATE_MIN_HZ) if self._commands_s else 0.0


class HeldTelemetry:
    """Telemetry that holds for `TELEMETRY_HOLD_S`."""

    def __init__(self) -> None:
        self.newest: Point | None = None

    def take(self, time_s: float, value: float | None) -> None:
        """Takes what was measured, if it was."""
        if value is not None and math.isfinite(value):
            self.newest = Point(time_s, value)

    def at(self, time_s: float) -> float | None:
        """What holds then."""
        if self.newest is None or time_s - self.newest.time_s > TELEMETRY_HOLD_S:
            return None
        return self.newest.value


class ThrusterAligner:
    """Commands and reports of one thruster in, evenly spaced samples out. See the module's text for the rules.

    Args:
        sample_rate_hz: samples a second; None = learnt from the reports.
        gap_s: reports further apart than this are not joined.
        stale_s: a command holds for this long.
        streamed: commands come at an even rate, which others may change.
        phase: of the grid, from 0 to less than 1 period.

    Attributes:
        rate_hz: the sample rate, None while it is learnt.
        phase: as given.
        drops: refused inputs by cause.
        held, speed, voltage, current, last_index: the newest of what came, and the last grid point that was given
            out, for `align_columns`.

    Raises:
        ValueError: a rate or time that is not positive and finite, or a phase out of its range.
    """

    def __init__(
        self,
        sample_rate_hz: float | None = None,
        gap_s: float = 0.5,
        stale_s: float = 0.5,
        streamed: bool = False,
        phase: float = 0.0,
    ) -> None:
        for name, value in (("sample_rate_hz", sample_rate_hz), ("gap_s", gap_s), ("stale_s", stale_s)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value!r}: want a positive, finite number")
        if not 0.0 <= phase < 1.0:
            raise ValueError(f"phase = {phase!r}: want a part of a period, from 0 to less than 1")
        self.rate_hz, self.phase = sample_rate_hz, phase
        self.drops: Counter[str] = Counter()
        self.gap_s = gap_s
        # the longest look back: from the newest command to the start of the period before the older of two reports
        self.held = HeldCommand(stale_s, keep_s=gap_s + stale_s + 1.0 / (sample_rate_hz or RATES_HZ[0]))
        self._stale_s = stale_s
        self._usual = UsualInterval() if streamed else None
        self._learner = RateLearner()
        self.speed: Point | None = None
        self.voltage = HeldTelemetry()
        self.current = HeldTelemetry()
        self.last_index: int | None = None

    @property
    def regular(self) -> bool:
        """True where nothing is to be learnt from single readings."""
        return self.rate_hz is not None and self._usual is None

    @property
    def slow(self) -> bool:
        """True while commands come so rarely that they are not known most of the time."""
        return self._usual is not None and self._usual.slow

    def command(self, time_s: float, fraction: float) -> None:
        """Takes a command, -1.0 to 1.0, that holds from `time_s` on."""
        if not (is_time(time_s) and math.isfinite(fraction)):
            self.drops["command not finite"] += 1
        elif (interval_s := self.held.append(time_s, fraction)) is None:
            self.drops["command time ran backwards"] += 1
        elif interval_s > 0.0:
            if self.rate_hz is None:
                self._learner.command(interval_s)
            if self._usual is not None:
                self._usual.take(interval_s)
                self.held.stale_s = min(self._stale_s, self._usual.stale_s)

    def report(
        self,
        time_s: float,
        speed_rpm: float | None,
        voltage_v: float | None = None,
        current_a: float | None = None,
    ) -> list[ThrusterSample]:
        """Takes a report; gives out the samples that it completes, oldest first, at most `gap_s * rate_hz` + 1."""
        samples: list[ThrusterSample] = []
        if not is_time(time_s):
            self.drops["report not finite"] += 1
            return samples
        if speed_rpm is not None:
            samples = self._take_speed(time_s, speed_rpm)
        self.voltage.take(time_s, voltage_v)
        self.current.take(time_s, current_a)
        return samples

    def _take_speed(self, time_s: float, speed_rpm: float) -> list[ThrusterSample]:
        if not math.isfinite(speed_rpm):
            self.drops["report not finite"] += 1
            return []
        before, now = self.speed, Point(time_s, speed_rpm)
        if before is not None and time_s <= before.time_s:
            self.drops["report time ran backwards"] += 1
            return []
        self.speed = now
        if before is None or time_s - before.time_s > self.gap_s:
            return []
        if self.rate_hz is None:
            self.rate_hz = self._learner.report(time_s - before.time_s)
            return []
        return list(self._samples_between(before, now, self.rate_hz))

    def _samples_between(self, before: Point, now: Point, rate_hz: float) -> Iterator[ThrusterSample]:
        phase = self.phase
        first = math.floor(before.time_s * rate_hz - phase) + 1
        if self.last_index is not None:
            first = max(first, self.last_index + 1)
        for index in range(first, math.floor(now.time_s * rate_hz - phase) + 1):
            self.last_index = index
            time_s = (index + phase) / rate_hz
            command = self.held.mean((index - 1 + phase) / rate_hz, time_s)
            self.held.forget_before(time_s)
            if command is not None:
                yield self._sample(time_s, command, before, now)

    def _sample(self, time_s: float, command: float, before: Point, now: Point) -> ThrusterSample:
        share = (time_s - before.time_s) / (now.time_s - before.time_s)
        speed_rpm = before.value + (now.value - before.value) * min(max(share, 0.0), 1.0)
        return ThrusterSample(time_s, command, speed_rpm, self.voltage.at(time_s), self.current.at(time_s))
