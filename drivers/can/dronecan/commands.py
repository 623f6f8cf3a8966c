"""esc.RawCommand and esc.RPMCommand to commands of thrusters: one by one, and many at once with the same result."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drivers.bus_readings import CommanderConflict
from drivers.can.dronecan.claims import Claim
from drivers.can.dronecan.reports import count
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND, Setpoints
from drivers.can.dronecan.thruster import DroneCanThruster, commanded_by, raw_fractions
from drivers.can.dronecan.transfer_block import Bools, Integers, Transfers
from drivers.command import CommandScale
from drivers.construction import constructor
from drivers.reading_block import CommandColumns
from drivers.readings import Reading, ThrusterCommand

Fraction = Callable[[int], float | None]

_command = constructor(ThrusterCommand)


@dataclass(frozen=True, slots=True)
class _Part:
    """A thruster's part in a command message.

    Attributes:
        thruster: whose.
        number: its number.
        offset: bits before its word.
        scale: of its numbers.
        fraction: what a word means, -1.0..1.0; None: out of range.
    """

    thruster: DroneCanThruster
    number: int
    offset: int
    scale: CommandScale
    fraction: Fraction

    @classmethod
    def of(cls, thruster: DroneCanThruster, message: Setpoints) -> _Part:
        """A thruster's part in a message."""
        scale = thruster.scale
        fraction = raw_fractions(scale).__getitem__ if message is RAW_COMMAND else _fraction(scale, message)
        return cls(thruster, thruster.thruster, message.bits * thruster.esc_index, scale, fraction)


class CommandReader:
    """Payloads of RawCommand and RPMCommand to commands. Both are commands: one node may send them.

    Args:
        thrusters: what is wired to the bus.
        drops: see `DroneCanDecoder`.
    """

    def __init__(self, thrusters: Sequence[DroneCanThruster], drops: Counter[str]) -> None:
        self._drops = drops
        self._claim = Claim()
        self._parts = {
            message.data_type.key: [_Part.of(one, message) for one in commanded_by(thrusters, message)]
            for message in (RAW_COMMAND, RPM_COMMAND)
        }

    def read(self, message: Setpoints, payload: bytes, source: int, time_s: float) -> Sequence[Reading]:
        """Readings of one message."""
        given = message.counts.get(len(payload))
        if given is None:
            self._drops["wrong length"] += 1
            return ()
        readings: list[Reading] = []
        if self._claim.admits(source, time_s):
            readings += self._commands(message, payload, given, time_s)
        else:
            self._drops["duplicate source"] += 1
        if self._claim.rivals and (nodes := self._claim.contested(source, time_s)):
            readings.append(CommanderConflict(time_s, nodes))
        return readings

    def _commands(self, message: Setpoints, payload: bytes, given: int, time_s: float) -> Iterator[Reading]:
        bits, mask = message.bits, message.mask
        packed = int.from_bytes(payload, "big") >> 8 * len(payload) - bits * given
        last = bits * (given - 1)
        for part in self._parts[message.data_type.key]:
            shift = last - part.offset
            if shift < 0:
                self._drops["command missing"] += 1
                continue
            fraction = part.fraction(packed >> shift & mask) if packed else 0.0  # nothing but zeros: disarmed
            if fraction is None:
                self._drops["command out of range"] += 1
            else:
                yield _command(time_s, part.number, fraction)

    def read_block(self, raw: Transfers, rpm: Transfers) -> tuple[list[CommandColumns], list[tuple[int, Reading]]]:
        """Readings of many messages: of each, what `read` gives; what is told of conflicts with its row."""
        right = [self._of_right_length(RAW_COMMAND, raw), self._of_right_length(RPM_COMMAND, rpm)]
        rows = np.concatenate([one.row for one in right])
        if not len(rows):
            return [], []
        order = np.argsort(rows, kind="stable")
        source = np.concatenate([one.source for one in right])[order]
        time_s = np.concatenate([one.time_s for one in right])[order]
        taken = self._claim.admit(source, time_s)
        count(self._drops, "duplicate source", ~taken.admitted)
        admitted = np.empty(len(rows), np.bool_)
        admitted[order] = taken.admitted
        of_raw, of_rpm = admitted[: len(right[0])], admitted[len(right[0]) :]
        columns = [
            *self._columns(RAW_COMMAND, right[0].part(of_raw)),
            *self._columns(RPM_COMMAND, right[1].part(of_rpm)),
        ]
        conflicts: list[tuple[int, Reading]] = [
            (int(rows[order[place]]), CommanderConflict(float(time_s[place]), nodes))
            for place, nodes in taken.contests
        ]
        return sorted(columns, key=lambda one: one.thruster), conflicts

    def _of_right_length(self, message: Setpoints, transfers: Transfers) -> Transfers:
        right = np.isin(transfers.size, list(message.counts))
        count(self._drops, "wrong length", ~right)
        return transfers.part(right)

    def _columns(self, message: Setpoints, transfers: Transfers) -> list[CommandColumns]:
        """Commands of each thruster that has any."""
        if not len(transfers):
            return []
        given = _given(message, transfers)
        disarmed = _disarmed(message, transfers, given)
        columns = []
        for part in self._parts[message.data_type.key]:
            thruster = part.thruster
            having = given > thruster.esc_index
            count(self._drops, "command missing", ~having)
            words = message.word_column(transfers.payload, thruster.esc_index)
            fractions = part.scale.fractions(message.number(words).astype(np.float64))
            fractions[disarmed] = 0.0
            valid = ~np.isnan(fractions)
            count(self._drops, "command out of range", having & ~valid)
            if (valid := valid & having).any():
                rows, times_s = transfers.row[valid], transfers.time_s[valid]
                columns.append(CommandColumns(thruster.thruster, rows, times_s, fractions[valid]))
        return columns


def _fraction(scale: CommandScale, message: Setpoints) -> Fraction:
    return lambda word: scale.fraction(message.number(word))


def _given(message: Setpoints, transfers: Transfers) -> Integers:
    """(N,) how many numbers each message has."""
    given = np.zeros(message.data_type.payload_max + 1, np.int64)
    given[list(message.counts)] = list(message.counts.values())
    return given[transfers.size]


def _disarmed(message: Setpoints, transfers: Transfers, given: Integers) -> Bools:
    """(N,) whether all numbers of a message are 0; what fills up its last byte is none."""
    payload, size = transfers.payload, transfers.size
    last = payload[np.arange(len(payload)), size - 1].astype(np.int64)
    padding = 8 * size - message.bits * given
    others = payload.sum(axis=1, dtype=np.int64) - last
    disarmed: Bools = (others == 0) & (last >> padding == 0)
    return disarmed
