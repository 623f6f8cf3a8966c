"""A bus whose messages have fixed layouts: frames to readings by their message's plan, one by one or in blocks."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Protocol, TypeVar

import numpy as np

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter, CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FrameBlock
from drivers.can.messages.plan import Columns, IndexArray, MessageLayout
from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import Reading

KIND_SHIFT = 29  # of the bits of a frame's kind, above those of its identifier

_Told = TypeVar("_Told", CommandColumns, ReportColumns)


class Plan(Protocol):
    """What is done with the frames of one message, see `MessagePlan`."""

    @property
    def message(self) -> MessageLayout:
        """The message."""
        ...

    @property
    def decode(self) -> Callable[[CanFrame], Sequence[Reading]]:
        """Its readings of one frame."""
        ...

    def decode_block(self, block: FrameBlock, row: IndexArray) -> Columns:
        """Its readings of many frames."""
        ...


class MessageDecoder:
    """Frames to readings.

    Args:
        plans: one for each message that is read.
        drops: where the plans count what is thrown away.

    Attributes:
        plans, drops: as given.
    """

    def __init__(self, plans: Sequence[Plan], drops: Counter[str]) -> None:
        self.plans = tuple(plans)
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
        commands: defaultdict[int, list[CommandColumns]] = defaultdict(list)
        reports: defaultdict[int, list[ReportColumns]] = defaultdict(list)
        keys = block.identifier | (block.kind & (EXTENDED | ERROR)).astype(np.uint32) << KIND_SHIFT
        with np.errstate(over="ignore", invalid="ignore"):  # infinity and NaN are looked for where they matter
            for key, plan in self._plans.items():
                commanded, reported = plan.decode_block(block, np.flatnonzero(keys == key))
                for command in commanded:
                    commands[command.thruster].append(command)
                for report in reported:
                    reports[report.thruster].append(report)
        return ReadingBlock(_of_each_thruster(commands), _of_each_thruster(reports))


def _key(message: MessageLayout) -> int:
    return message.identifier | (EXTENDED if message.extended else 0) << KIND_SHIFT


def _of_each_thruster(told: Mapping[int, Sequence[_Told]]) -> tuple[_Told, ...]:
    return tuple(_merged(told[thruster]) for thruster in sorted(told))


def _merged(parts: Sequence[_Told]) -> _Told:
    """What several messages tell of one thruster, in the order of their frames."""
    if len(parts) == 1:
        return parts[0]
    order = np.argsort(np.concatenate([part.row for part in parts]), kind="stable")
    names = [field.name for field in fields(parts[0]) if field.name != "thruster"]
    columns = {name: np.concatenate([getattr(part, name) for part in parts])[order] for name in names}
    return type(parts[0])(parts[0].thruster, **columns)
