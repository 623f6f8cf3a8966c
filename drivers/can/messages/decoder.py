"""A bus whose messages have fixed layouts: frames to readings by their message's plan, one by one or in blocks."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter, CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FrameBlock
from drivers.can.messages.plan import MessageLayout, MessagePlan
from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import Reading

KIND_SHIFT = 29  # of the bits of a frame's kind, above those of its identifier


class MessageDecoder:
    """Frames to readings.

    Args:
        plans: one for each message that is read.
        drops: where the plans count what is thrown away.
    """

    def __init__(self, plans: Sequence[MessagePlan], drops: Counter[str]) -> None:
        self.drops = drops
        self._plans = {_key(plan.message): plan for plan in plans}
        self._standard = {one.message.identifier: one.decode for one in plans if not one.message.extended}
        self._extended = {one.message.identifier: one.decode for one in plans if one.message.extended}

    def filters(self) -> list[CanFilter]:
        """One for each message."""
        messages = [plan.message for plan in self._plans.values()]
        return [
            CanFilter(message.identifier, EXTENDED_MASK if message.extended else STANDARD_MASK, message.extended)
            for message in messages
        ]

    def decode(self, frame: CanFrame) -> Sequence[Reading]:
        """Readings of the thrusters that this message tells of: commands, then reports, of ascending thrusters."""
        decode = (self._extended if frame.extended else self._standard).get(frame.identifier)
        return () if decode is None or frame.error else decode(frame)

    def decode_block(self, block: FrameBlock) -> ReadingBlock:
        """What `decode` gives of each of the frames, and counts, much faster."""
        commands: list[CommandColumns] = []
        reports: defaultdict[int, list[ReportColumns]] = defaultdict(list)
        keys = block.identifier | (block.kind & (EXTENDED | ERROR)).astype(np.uint32) << KIND_SHIFT
        with np.errstate(over="ignore", invalid="ignore"):  # infinity and NaN are looked for where they matter
            for key, plan in self._plans.items():
                told, reported = plan.decode_block(block, np.flatnonzero(keys == key))
                commands += told
                for report in reported:
                    reports[report.thruster].append(report)
        commands.sort(key=lambda one: one.thruster)
        return ReadingBlock(tuple(commands), tuple(_merged(reports[thruster]) for thruster in sorted(reports)))


def _key(message: MessageLayout) -> int:
    return message.identifier | (EXTENDED if message.extended else 0) << KIND_SHIFT


def _merged(parts: Sequence[ReportColumns]) -> ReportColumns:
    """Reports of one thruster from several messages, in the order of their frames."""
    if len(parts) == 1:
        return parts[0]
    order = np.argsort(np.concatenate([part.row for part in parts]), kind="stable")

    def column(name: str) -> np.ndarray:
        together: np.ndarray = np.concatenate([getattr(part, name) for part in parts])[order]
        return together

    names = ("row", "time_s", "speed_rpm", "voltage_v", "current_a", "temperature_k", "error_count")
    return ReportColumns(parts[0].thruster, *map(column, names))
