"""esc.Status to reports of thrusters: one by one, and many at once with the same result."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.bus_readings import EscConflict
from drivers.can.dronecan.bits import signed
from drivers.can.dronecan.claims import Claim
from drivers.can.dronecan.esc_status import ESC_INDEX_MAX, SPEED_BITS, STATUS_DTYPE, EscStatus, unpack_status
from drivers.can.dronecan.nodes import NodeWatch
from drivers.can.dronecan.thruster import DroneCanThruster
from drivers.can.dronecan.transfer_block import Bools, Floats, Integers, Transfers
from drivers.construction import constructor
from drivers.reading_block import ReportColumns
from drivers.readings import Reading, ThrusterReport

# what an ESC with 16 bits for it says where it does not know
UNKNOWN_RPM = 0xFFFF

# (N,) of STATUS_DTYPE
Columns: TypeAlias = NDArray[Any]

_report = constructor(ThrusterReport)


@dataclass(slots=True)
class BlockReports:
    """What a block of transfers gave.

    Attributes:
        columns: ascending by thruster.
        conflicts: (row, what is told).
        handovers: (row, thruster, node that speaks for it from there on).
    """

    columns: list[ReportColumns] = field(default_factory=list)
    conflicts: list[tuple[int, Reading]] = field(default_factory=list)
    handovers: list[tuple[int, int, int]] = field(default_factory=list)


class ReportReader:
    """Payloads of esc.Status to reports.

    Args:
        thrusters: what is wired to the bus.
        speed_limit_rpm: a faster report is implausible.
        nodes: is told which node speaks for which thruster.
        drops: see `DroneCanDecoder`.
    """

    def __init__(
        self, thrusters: Sequence[DroneCanThruster], speed_limit_rpm: float, nodes: NodeWatch, drops: Counter[str]
    ) -> None:
        self._speed_limit_rpm, self._nodes, self._drops = speed_limit_rpm, nodes, drops
        self._escs = {one.esc_index: (one, Claim(one.node_id)) for one in thrusters}
        for one in thrusters:
            if one.node_id is not None:
                nodes.speaks_for(one.thruster, one.node_id)

    def read(self, payload: bytes, source: int, time_s: float) -> Sequence[Reading]:
        """Readings of one message."""
        status = unpack_status(payload)
        esc = None if status is None else self._escs.get(status.esc_index)
        if status is None or esc is None:
            self._drops["wrong length" if status is None else "unknown ESC"] += 1
            return ()
        thruster, claim = esc
        owner = claim.owner
        if not claim.admits(source, time_s):
            self._drops[_refused(claim)] += 1
            readings: list[Reading] = []
        else:
            if source != owner:
                self._nodes.speaks_for(thruster.thruster, source)
            readings = [self._report(thruster, status, time_s)]
        if claim.rivals and (nodes := claim.contested(source, time_s)):
            readings.append(_conflict(thruster, nodes, time_s))
        return readings

    def _report(self, thruster: DroneCanThruster, status: EscStatus, time_s: float) -> ThrusterReport:
        return _report(
            time_s,
            thruster.thruster,
            self._speed(thruster, status.speed_rpm),
            # An ESC that speaks has a supply and is warmer than 0 K: zero stands for "no sensor".
            self._measured(status.voltage_v, above=0.0),
            self._measured(status.current_a),
            self._measured(status.temperature_k, above=0.0),
            status.error_count,
        )

    def _speed(self, thruster: DroneCanThruster, reported_rpm: int) -> float | None:
        if abs(reported_rpm) > self._speed_limit_rpm or abs(reported_rpm) == UNKNOWN_RPM:
            self._drops["implausible speed"] += 1
            return None
        return thruster.speed_rpm(reported_rpm)

    def _measured(self, value: float, above: float = -math.inf) -> float | None:
        if math.isinf(value):
            self._drops["non-finite"] += 1
            return None
        return value if value > above else None  # None for NaN, too

    def read_block(self, transfers: Transfers) -> BlockReports:
        """Readings of many messages: of each, what `read` gives."""
        reports = BlockReports()
        if not len(transfers):
            return reports
        right = transfers.size == STATUS_DTYPE.itemsize
        count(self._drops, "wrong length", ~right)
        transfers = transfers.part(right)
        status = np.ascontiguousarray(transfers.payload).view(STATUS_DTYPE)[:, 0]
        for index, which in _by_index((status["high"] >> 2 & ESC_INDEX_MAX).astype(np.uint8)):
            if index in self._escs:
                self._read_esc(*self._escs[index], transfers.part(which), status[which], reports)
            else:
                self._drops["unknown ESC"] += len(which)
        reports.columns.sort(key=lambda one: one.thruster)
        reports.handovers.sort()
        return reports

    def _read_esc(
        self, thruster: DroneCanThruster, claim: Claim, transfers: Transfers, status: Columns, reports: BlockReports
    ) -> None:
        """Takes all messages of one ESC index; there is at least one."""
        taken = claim.admit(transfers.source, transfers.time_s)
        count(self._drops, _refused(claim), ~taken.admitted)
        rows, times_s = transfers.row, transfers.time_s
        reports.handovers += [(int(rows[place]), thruster.thruster, node) for place, node in taken.handovers]
        reports.conflicts += [
            (int(rows[place]), _conflict(thruster, nodes, float(times_s[place]))) for place, nodes in taken.contests
        ]
        if taken.admitted.all():
            reports.columns.append(self._columns(thruster, rows, times_s, status))
        elif taken.admitted.any():
            admitted = taken.admitted
            reports.columns.append(self._columns(thruster, rows[admitted], times_s[admitted], status[admitted]))

    def _columns(self, thruster: DroneCanThruster, rows: Integers, times_s: Floats, status: Columns) -> ReportColumns:
        return ReportColumns(
            thruster.thruster,
            rows,
            times_s,
            self._speeds(thruster, status),
            self._measurements(status["voltage_v"], above=0.0),
            self._measurements(status["current_a"]),
            self._measurements(status["temperature_k"], above=0.0),
            status["error_count"].astype(np.float64),
        )

    def _speeds(self, thruster: DroneCanThruster, status: Columns) -> Floats:
        bits = status["low"].astype(np.int64) | (status["middle"].astype(np.int64) >> 6) << 16
        reported_rpm = signed(bits, SPEED_BITS)
        magnitude_rpm = np.abs(reported_rpm)
        implausible = (magnitude_rpm > self._speed_limit_rpm) | (magnitude_rpm == UNKNOWN_RPM)
        count(self._drops, "implausible speed", implausible)
        if not thruster.signed:
            reported_rpm = magnitude_rpm
        elif thruster.reverse:
            reported_rpm = -reported_rpm
        return np.where(implausible, np.nan, reported_rpm)

    def _measurements(self, halves: NDArray[np.float16], above: float = -math.inf) -> Floats:
        values = halves.astype(np.float64)
        infinite = np.isinf(values)
        count(self._drops, "non-finite", infinite)
        return np.where(~infinite & (values > above), values, np.nan)


def count(drops: Counter[str], cause: str, dropped: Bools) -> None:
    """Counts what was dropped of many."""
    if number := int(np.count_nonzero(dropped)):
        drops[cause] += number


def _refused(claim: Claim) -> str:
    return "duplicate source" if claim.node_id is None else "unknown node"


def _conflict(thruster: DroneCanThruster, nodes: tuple[int, ...], time_s: float) -> EscConflict:
    return EscConflict(time_s, thruster.thruster, thruster.esc_index, nodes, thruster.node_id)


def _by_index(esc_index: NDArray[np.uint8]) -> Iterator[tuple[int, Integers]]:
    """The places at which each index stands, ascending."""
    order = np.argsort(esc_index, kind="stable")
    ends = np.searchsorted(esc_index[order], np.arange(ESC_INDEX_MAX + 2))
    for index in np.flatnonzero(np.diff(ends)).tolist():
        yield index, order[ends[index] : ends[index + 1]]
