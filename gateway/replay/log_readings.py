"""Logs to readings of the configuration's links, by the decoders of the running gateway."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from math import inf
from pathlib import Path

from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash import dataflash_clock, read_dataflash
from drivers.logs.tlog import read_tlog
from drivers.logs.ulog import read_ulog, ulog_clock
from drivers.reading_block import ReadingBlock
from drivers.readings import IdentityConflict
from gateway.config import Config
from gateway.config_sections import MAVLINK, CanBus, Mavlink
from gateway.forwarded_bus import ForwardedDecoder
from gateway.recording.reading import read_about, read_entries
from gateway.replay.bus_readings import BusReadings
from gateway.replay.log_input import LogInput, LogKind
from gateway.replay.recorded_links import RecordedLinks
from gateway.replay.recorded_order import in_stretches
from gateway.replay.set_back import BACK_S, Blocks, LogClock, SetBack
from gateway.wiring import mavlink_decoder, mavlink_thrusters

# of a recording, what is given out link by link
PART_S = 1.0


class LogReadings:
    """One log, or several of one kind that follow each other.

    Args:
        logs: in the order of their times.
        config: whose links they are of.

    Attributes:
        damage: of each log, what was lost of it.
        unused: frames of interfaces that no link of the configuration is for, by interface.
        set_back: of each log, where its clock was.

    Raises:
        ValueError: the configuration has no link that such a log could be of.
    """

    def __init__(self, logs: Sequence[LogInput], config: Config) -> None:
        self.logs, self._config = tuple(logs), config
        self.damage = {log.path: DamageReport() for log in logs}
        self.unused: Counter[str] = Counter()
        self.set_back: dict[Path, list[SetBack]] = {}
        self._drops: list[tuple[str, Callable[[], Counter[str]]]] = []
        self._read: dict[str, BusReadings] = {}
        self._buses: defaultdict[Path, dict[str, CanBus | None]] = defaultdict(dict)
        for log in logs:
            _check(log, config)

    def drops(self) -> dict[str, Counter[str]]:
        """What was thrown away, and what was wrong with a bus, by link and cause."""
        total: defaultdict[str, Counter[str]] = defaultdict(Counter)
        for link, drops in self._drops:
            total[link] += drops()
        return total

    def again(self) -> LogReadings:
        """The same logs, unread."""
        return LogReadings(self.logs, self._config)

    @cached_property  # it looks through the whole of a log
    def unix(self) -> bool:
        """Whether the times are unix seconds; else they count from some beginning."""
        clocks = {LogKind.DATAFLASH: dataflash_clock, LogKind.ULOG: ulog_clock}
        return all(log.kind not in clocks or clocks[log.kind](log.path).is_unix for log in self.logs)

    def __iter__(self) -> Blocks:
        """Link and readings, part by part of the log.

        Raises:
            OSError: a log cannot be read.
            ValueError: it is not of its kind, or begins before the one before it ends.
        """
        end_s = -inf
        for log in self.logs:
            clock = LogClock()
            self.set_back[log.path] = clock.set_back
            for link, block in clock.going_on(self._read_log(log)):
                if clock.begin_s < end_s - BACK_S:
                    raise ValueError(f"{log.path} begins before the log before it ends: replay one of them")
                yield link, block
            end_s = max(end_s, clock.end_s)

    def beginning(self) -> tuple[frozenset[str], float]:
        """Of the first log, its links as its beginning shows them, and when that is; infinity where it is empty."""
        begins_s: dict[str, float] = {}
        for link, block in self._read_log(self.logs[0]):
            if link in begins_s:
                break
            if block:
                begins_s[link] = float(block.times()[1][0])
        return frozenset(begins_s), min(begins_s.values(), default=inf)

    def _read_log(self, log: LogInput) -> Blocks:
        if log.kind is LogKind.RECORDING:
            return self._recording(log)
        return self._can(log) if log.kind is LogKind.CAN else self._mavlink(log)

    def _recording(self, log: LogInput) -> Blocks:
        """Of a run of ours, beside other logs: its readings by their times, as those of the others are."""
        links = RecordedLinks(self._config, read_about(log.path).started_s)
        self._drops += [(name, partial(_drops_of, links, name)) for name in self._config.links()]
        for entries in in_stretches(read_entries(log.path, self.damage[log.path]), PART_S):
            for entry in entries:
                links.take(entry)
            for arrival in links.arrivals():
                if log.link in (None, arrival.link):
                    yield arrival.link, arrival.readings

    def _can(self, log: LogInput) -> Blocks:
        for interface, frames in open_can_log(log.path, self.damage[log.path]):
            bus = self.bus_of(interface, log)
            if bus is None:
                self.unused[interface] += len(frames)
            else:
                yield bus.name, self._readings_of(bus).decode(frames)

    def bus_of(self, interface: str, log: LogInput) -> CanBus | None:
        """The bus that an interface of one of the logs is; None: no link of the configuration.

        Raises:
            ValueError: it would be the same as another interface of that log.
        """
        known = self._buses[log.path]
        if interface not in known:
            bus = _bus_of(interface, log, self._config)
            other = next((name for name, one in known.items() if bus is not None and one is bus), None)
            if other is not None:
                raise ValueError(
                    f"{log.path} has frames of {other} and of {interface}, and both would be {log.link or interface}:"
                    " give the buses in the configuration the channels that they have in the log, and name it alone"
                )
            known[interface] = bus
        return known[interface]

    def _readings_of(self, bus: CanBus) -> BusReadings:
        if bus.name not in self._read:
            self._read[bus.name] = BusReadings(bus, self._config)
            self._drops.append((bus.name, self._read[bus.name].drops))
        return self._read[bus.name]

    def _mavlink(self, log: LogInput) -> Blocks:
        if log.kind is LogKind.TLOG:
            yield from self._tlog(log)
            return
        read = read_dataflash if log.kind is LogKind.DATAFLASH else read_ulog
        wired = mavlink_thrusters(self._config.thruster)
        for readings in read(log.path, wired, self.damage[log.path], self._config.navigation is not None):
            yield MAVLINK, ReadingBlock.of(readings)

    def _tlog(self, log: LogInput) -> Blocks:
        """Of the link, and of the bus that the autopilot forwards over it."""
        config = self._config
        bus = next((bus for bus in config.can if bus.forwarded), None)
        forwarded = None if bus is None else ForwardedDecoder(bus, config)
        decoder = mavlink_decoder(
            _mavlink_of(config, log),
            config.thruster,
            navigation=config.navigation is not None,
            can_frames=None if forwarded is None else forwarded.frames,
        )
        self._drops.append((MAVLINK, decoder.drops.copy))
        if bus is not None and forwarded is not None:
            self._drops.append((bus.name, forwarded.drops))
        for readings in read_tlog(log.path, decoder, self.damage[log.path]):
            decoder.answers()  # nobody is there to take them
            # the gateway that watched this dive spoke on the link as well: it is no other program with its ids
            heard = [reading for reading in readings if not isinstance(reading, IdentityConflict)]
            yield MAVLINK, ReadingBlock.of(heard)
            if bus is not None and forwarded is not None:
                frames = [one.frame for one in forwarded.frames.take() if str(one.bus) == bus.channel]
                yield bus.name, ReadingBlock.of(forwarded.decode(frames))


def _drops_of(links: RecordedLinks, name: str) -> Counter[str]:
    return links.drops()[name]


def _mavlink_of(config: Config, log: LogInput) -> Mavlink:
    if config.mavlink is None:
        raise ValueError(f"{log.path} is a log of an autopilot: the configuration has no [mavlink]")
    return config.mavlink


def _check(log: LogInput, config: Config) -> None:
    if log.kind is LogKind.RECORDING:  # it may have any link
        return
    if log.kind is not LogKind.CAN:
        _mavlink_of(config, log)
    buses = {bus.name for bus in config.can}
    if log.link is not None and (log.link in buses) != (log.kind is LogKind.CAN):
        wanted = "a log of CAN" if log.link in buses else "a .tlog, .BIN or .ulg"
        raise ValueError(f"{log.link}={log.path}: it is a {log.kind} log, want {wanted} for {log.link}")
    if log.kind is LogKind.CAN and not buses:
        raise ValueError(f"{log.path} is a log of CAN: the configuration has no [[can]]")


def _bus_of(interface: str, log: LogInput, config: Config) -> CanBus | None:
    """The bus that an interface of a log is: as the user said, by channel or name, by its number in a tool's file."""
    if log.link is not None:
        return config.bus(log.link)
    for bus in config.can:
        if interface in (bus.channel, bus.name) and not bus.forwarded:
            return bus
    number = int(interface) if interface.isdecimal() else 0
    own = [bus for bus in config.can if not bus.forwarded]
    return own[number - 1] if 1 <= number <= len(own) else None
