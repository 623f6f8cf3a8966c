"""What a run received, as it wrote it down, through the decoders of the running gateway."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from operator import itemgetter

import numpy as np

from drivers.can.decoder import CanDecoder
from drivers.can.frame_block import ERROR, FrameBlock
from drivers.mavlink.frames import Gate
from drivers.reading_block import FloatArray, ReadingBlock
from drivers.readings import OwnClock, Reading
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.forwarded_bus import ForwardedDecoder
from gateway.judging import GATEWAY
from gateway.problems import ConfigError
from gateway.recording.entries import Entry, Frames, Heard, Spoken, Tick, Told
from gateway.signing.link import replayed
from gateway.signing.unchecked import Unchecked
from gateway.stretches.stretch import BlockArrival
from gateway.wiring import can_decoder, mavlink_decoder

# what is judged in front of a place comes before all that is at it
IN_FRONT = 0.5

_Placed = tuple[ReadingBlock, FloatArray]


class RecordedLinks:
    """Entries in, in their order; readings out, with the places that they had among all.

    States of links, loads and losses were written down as they were told: they are not found anew from the frames.

    Args:
        config: whose links they are.
        started_s: when the run began, unix.

    Attributes:
        remark: what is not as it was in the run; empty where nothing is.
        unused: frames of buses that are not in the configuration, by bus.
    """

    def __init__(self, config: Config, started_s: float) -> None:
        self.remark = ""
        self.unused: Counter[str] = Counter()
        self._buses: dict[str, CanDecoder] = {
            bus.name: can_decoder(bus, config.thruster) for bus in config.can if not bus.forwarded
        }
        forwarded = next((bus for bus in config.can if bus.forwarded), None)
        self._forwarded = None if forwarded is None else (forwarded, ForwardedDecoder(forwarded, config))
        self._decoder = None
        if config.mavlink is not None:
            self._decoder = mavlink_decoder(
                config.mavlink,
                config.thruster,
                navigation=config.navigation is not None,
                gate=self._gate(config, started_s),
                can_frames=None if self._forwarded is None else self._forwarded[1].frames,
            )
        self._frames: defaultdict[str, list[Frames]] = defaultdict(list)
        self._singles: defaultdict[str, list[tuple[float, Reading]]] = defaultdict(list)

    def take(self, entry: Entry) -> None:
        """Takes the next one; those of one link are in the order of their places."""
        match entry:
            case Frames():
                self._take_frames(entry)
            case Heard():
                self._take_heard(entry)
            case Spoken() if self._decoder is not None:
                self._decoder.sent(entry.data, entry.time_s)
            case Told():
                place = entry.place if entry.before is None else entry.before - IN_FRONT
                self._singles[entry.link].append((place, entry.reading))
            case Tick():
                self._singles[GATEWAY].append((entry.place, OwnClock(entry.time_s)))

    def arrivals(self) -> list[BlockArrival]:
        """What came of all that was taken since the last time, link by link."""
        blocks: defaultdict[str, list[_Placed]] = defaultdict(list)
        for bus, several in self._frames.items():
            blocks[bus].append(_decoded(self._buses[bus], several))
        for link, singles in self._singles.items():
            blocks[link].append(_in_order(singles))
        self._frames.clear()
        self._singles.clear()
        # of one place, what the autopilot says comes before that which it forwards
        arrivals = [_interleaved(link, blocks[link]) for link in sorted(blocks, key=lambda link: link != MAVLINK)]
        return [arrival for arrival in arrivals if arrival.readings]

    def drops(self) -> dict[str, Counter[str]]:
        """What was thrown away, by link and cause."""
        drops = {name: Counter(decoder.drops) for name, decoder in self._buses.items()}
        if self._decoder is not None:
            drops[MAVLINK] = Counter(self._decoder.drops)
        if self._forwarded is not None:
            drops[self._forwarded[0].name] = self._forwarded[1].drops()
        return drops

    def _gate(self, config: Config, started_s: float) -> Gate | None:
        if config.mavlink is None:
            return None
        try:
            return replayed(config.mavlink, started_s)
        except ConfigError as error:
            self.remark = f"signatures were not checked: {error}"
            return Unchecked(config.mavlink.accept_unsigned)

    def _take_frames(self, entry: Frames) -> None:
        if entry.bus in self._buses:
            self._frames[entry.bus].append(entry)
        else:
            self.unused[entry.bus] += len(entry.frames)

    def _take_heard(self, entry: Heard) -> None:
        if self._decoder is None:
            return
        self._singles[MAVLINK] += self._at(entry, self._decoder.decode(entry.data, entry.time_s))
        self._decoder.answers()  # they were given then
        if self._forwarded is not None:
            bus, forwarded = self._forwarded
            frames = [one.frame for one in forwarded.frames.take() if str(one.bus) == bus.channel]
            self._singles[bus.name] += self._at(entry, forwarded.decode(frames))

    @staticmethod
    def _at(entry: Heard, readings: list[Reading]) -> Iterator[tuple[float, Reading]]:
        return ((float(entry.place), reading) for reading in readings)


def _decoded(decoder: CanDecoder, several: Sequence[Frames]) -> _Placed:
    """Of the frames of a bus, without those that its controller has made up."""
    frames = FrameBlock.joined([one.frames for one in several])
    data = frames.kind & ERROR == 0
    block = decoder.decode_block(frames.part(data))
    return block, np.concatenate([one.place for one in several])[data][: block.rows].astype(np.float64)


def _in_order(singles: Sequence[tuple[float, Reading]]) -> _Placed:
    ordered = sorted(singles, key=itemgetter(0))  # stable
    places = np.array([place for place, _ in ordered], dtype=np.float64)
    return ReadingBlock.of([reading for _, reading in ordered]), places


def _interleaved(link: str, several: list[_Placed]) -> BlockArrival:
    """Blocks of one link as one, in the order of the places."""
    block = ReadingBlock.joined([block for block, _ in several])
    place = np.concatenate([place for _, place in several])
    if (np.diff(place) < 0.0).any():
        order = np.argsort(place, kind="stable")
        row = np.empty(len(order), dtype=np.intp)
        row[order] = np.arange(len(order))
        block, place = block.reordered(row), place[order]
    return BlockArrival(link, block, place)
