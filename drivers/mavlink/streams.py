"""Asking the autopilot for the messages that are read, at the rates that are needed.

The table (state x what comes in; times are passed in, nothing waits):

| state | heartbeat | acknowledgement | no answer | restart of autopilot or link |
|---|---|---|---|---|
| silent | -> asking, first request | | | |
| asking | | noted, next request; -> settled | sent again, at last noted, next | -> asking, first request |
| settled | | | -> asking, after 30 s, if nothing at all was answered | -> asking, first request |

A stream that came as often as it was asked for, and comes less than half as often now, is asked for again, after 5 s
and then ever more rarely: whoever shares the link with us (a ground station that asks for all streams at once) sets
it down for all.

Intervals are forgotten by an autopilot that restarts. That is seen by its time since boot, by a gap in its
heartbeats, by the link coming up again, or, where none of these shows, by telemetry that stops while heartbeats go
on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from drivers.mavlink import formats
from drivers.mavlink.command_exchange import CommandExchange, Ended
from drivers.mavlink.messages import CommandLong
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    GlobalPosition,
    Inertial,
    LinkState,
    LocalPosition,
    Reading,
    ThrusterCommand,
    ThrusterReport,
)

COMMAND_SET_MESSAGE_INTERVAL = 511
AUTOPILOT_PX4 = 12  # MAV_AUTOPILOT_PX4

SILENCE_S = 5.0
ROUND_S = 30.0
# rates are looked at so often; a stream counts as granted, and as set down, at these shares of what was asked for
RATE_S = 5.0
FULL_SHARE, SLOW_SHARE = 0.75, 0.5
PAUSE_MAX_S = 60.0

_TELEMETRY = (Attitude, GlobalPosition, Inertial, LocalPosition, ThrusterCommand, ThrusterReport)


@dataclass(frozen=True, slots=True)
class Stream:
    """A message, and how often it should come.

    Raises:
        ValueError: rate not above 0 Hz.
    """

    message_id: int
    rate_hz: float

    def __post_init__(self) -> None:
        if not 0.0 < self.rate_hz < math.inf:
            raise ValueError(f"rate_hz must be above 0, got {self.rate_hz}")

    def request(self, autopilot: AutopilotHeartbeat) -> CommandLong:
        """SET_MESSAGE_INTERVAL: message id and interval in microseconds."""
        interval_us = round(1e6 / self.rate_hz)
        return CommandLong(
            command=COMMAND_SET_MESSAGE_INTERVAL,
            parameters=(float(self.message_id), float(interval_us), 0.0, 0.0, 0.0, 0.0, 0.0),
            target_system=autopilot.system_id,
            target_component=autopilot.component_id,
        )


# Each of these is a reading whenever it comes; of the others it depends on what the vehicle has.
_ALWAYS_READ = frozenset(
    one.message_id
    for one in (
        formats.SERVO_OUTPUT_RAW,
        formats.ACTUATOR_OUTPUT_STATUS,
        formats.ATTITUDE,
        formats.RAW_IMU,
        formats.HIGHRES_IMU,
        *formats.SCALED_IMUS,
    )
)


class StreamRates:
    """How often streams come, and which of them are to be asked for again."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._before: dict[int, int] = {}
        self._full: set[int] = set()  # those that came as often as they were asked for
        # when to ask again at the earliest, and after how long then
        self._again_s: dict[int, tuple[float, float]] = {}

    def slow(self, streams: Iterable[Stream], heard: Mapping[int, int], time_s: float) -> list[Stream]:
        """Streams that came often enough once, and do not now; of each time of `RATE_S` once."""
        if self._since_s is not None and time_s - self._since_s < RATE_S:
            return []
        lasted_s = math.inf if self._since_s is None else time_s - self._since_s
        rates_hz = {id_: (count - self._before.get(id_, 0)) / lasted_s for id_, count in heard.items()}
        self._since_s, self._before = time_s, dict(heard)
        return [one for one in streams if self._is_slow(one, rates_hz.get(one.message_id, 0.0), time_s)]

    def _is_slow(self, stream: Stream, rate_hz: float, time_s: float) -> bool:
        id_ = stream.message_id
        if rate_hz >= FULL_SHARE * stream.rate_hz:
            self._full.add(id_)
        again_s, pause_s = self._again_s.get(id_, (-math.inf, RATE_S))
        if id_ not in self._full or rate_hz >= SLOW_SHARE * stream.rate_hz or time_s < again_s:
            return False
        self._again_s[id_] = time_s + pause_s, min(2.0 * pause_s, PAUSE_MAX_S)
        return True


class StreamRequests:
    """Asks for one message after the other until each was answered.

    A refusal is a normal answer: an autopilot without ESC telemetry denies it.

    Args:
        streams: what to ask for, by MAV_AUTOPILOT.

    Attributes:
        accepted, refused, unanswered: message ids by what became of the last request. If all are unanswered, the
            autopilot takes no commands from us (ArduPilot's MAV_OPTIONS can restrict them to the ground station).
    """

    def __init__(self, streams: Callable[[int], Sequence[Stream]]) -> None:
        self._streams = streams
        self._autopilot: AutopilotHeartbeat | None = None
        self._waiting: list[Stream] = []
        self._asked_for: list[Stream] = []
        self._rates = StreamRates()
        self._exchange: CommandExchange | None = None
        self._before: CommandExchange | None = None
        self._round_s = -math.inf
        self._telemetry_s = -math.inf
        self.accepted: set[int] = set()
        self.refused: set[int] = set()
        self.unanswered: set[int] = set()

    @property
    def settled(self) -> bool:
        """True when every request of this round was answered, or given up."""
        return self._autopilot is not None and not self._waiting

    def update(
        self, readings: Iterable[Reading], time_s: float, heard: Mapping[int, int] | None = None
    ) -> list[CommandLong]:
        """Take what came in over this link, in order, and the time; call at least once a second.

        Args:
            readings: what came in.
            time_s: now.
            heard: how many messages of each id came from the autopilot so far; None: not counted.

        Returns:
            What to send now: nothing, or one request.
        """
        for reading in readings:
            self._take(reading)
        if self._autopilot is None:
            return []
        if self.settled and self._went_quiet(time_s):
            self._start_round(self._autopilot, time_s)
        elif self.settled and heard is not None:
            self._waiting += self._rates.slow(self._asked_for, heard, time_s)
        return self._request(self._autopilot, time_s)

    def _take(self, reading: Reading) -> None:
        match reading:
            case AutopilotHeartbeat():
                self._heartbeat(reading)
            case AutopilotReboot() if self._autopilot is not None:
                self._start_round(self._autopilot, reading.time_s)
            case LinkState(up=False):
                self._autopilot = None
            case CommandAcknowledgement() if self._exchange is not None:
                self._exchange.acknowledge(reading)
            case _ if isinstance(reading, _TELEMETRY):
                self._telemetry_s = reading.time_s

    def _heartbeat(self, reading: AutopilotHeartbeat) -> None:
        previous, self._autopilot = self._autopilot, reading
        if (
            previous is None
            or previous.system_id != reading.system_id
            or reading.time_s - previous.time_s > SILENCE_S
        ):
            self._start_round(reading, reading.time_s)

    def _start_round(self, autopilot: AutopilotHeartbeat, time_s: float) -> None:
        self._asked_for = list(self._streams(autopilot.autopilot))
        self._waiting = list(self._asked_for)
        self._rates = StreamRates()
        self._exchange, self._round_s = None, time_s
        self.accepted, self.refused, self.unanswered = set(), set(), set()

    def _went_quiet(self, time_s: float) -> bool:
        """Heartbeats come, but no answer at all, or none of the telemetry that was promised."""
        if time_s - self._round_s < ROUND_S:
            return False
        if not (self.accepted or self.refused):
            return bool(self.unanswered)
        return bool(self.accepted & _ALWAYS_READ) and time_s - self._telemetry_s > SILENCE_S

    def _request(self, autopilot: AutopilotHeartbeat, time_s: float) -> list[CommandLong]:
        """The request under way once more, or the next: an answer names the command only, so one at a time."""
        if self._exchange is not None:
            again = self._exchange.advance(time_s)
            if again is not None or self._exchange.ended is None:
                return [] if again is None else [again]
            self._note(self._exchange.ended)
        if not self._waiting:
            return []
        command = self._waiting[0].request(autopilot)
        self._exchange = CommandExchange(command, time_s, self._before)
        return [command]

    def _note(self, ended: Ended) -> None:
        noted = {Ended.ACCEPTED: self.accepted, Ended.REFUSED: self.refused, Ended.UNANSWERED: self.unanswered}
        noted[ended].add(self._waiting.pop(0).message_id)
        self._before, self._exchange = self._exchange, None
