"""Readings as columns, in the order in which they would have come one by one."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest

from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import LinkState, ThrusterCommand, ThrusterReport


def test_readings_come_in_the_order_of_their_frames():
    commands = [
        CommandColumns(thruster, np.array([0, 2]), np.array([1.0, 3.0]), np.array([0.1, 0.2]) * thruster)
        for thruster in (1, 2)
    ]
    unknown = np.array([nan])
    report = ReportColumns(1, np.array([1]), np.array([2.0]), np.array([900.0]), *[unknown] * 3, np.array([4.0]))
    state = LinkState(3.0, "can0", True, "")

    block = ReadingBlock(tuple(commands), (report,), ((2, state),))

    assert block.readings() == [
        ThrusterCommand(1.0, 1, 0.1),
        ThrusterCommand(1.0, 2, 0.2),
        ThrusterReport(2.0, 1, speed_rpm=900.0, error_count=4),
        ThrusterCommand(3.0, 1, 0.2),
        ThrusterCommand(3.0, 2, 0.4),
        state,
    ]
    assert type(block.readings()[2].error_count) is int


def block_of(first_s: float, thruster: int) -> ReadingBlock:
    row = np.array([0, 2])
    command = CommandColumns(thruster, row, first_s + row, 0.1 * row)
    report = ReportColumns(thruster, row + 1, first_s + row + 1.0, 900.0 + row, *[np.array([nan, nan])] * 4)
    return ReadingBlock((command,), (report,), ((3, LinkState(first_s + 3.0, "can0", True, "")),))


def test_joined_blocks_have_the_readings_of_one_after_the_other():
    blocks = [block_of(10.0, 1), block_of(20.0, 2), ReadingBlock(), block_of(30.0, 1)]
    joined = ReadingBlock.joined(blocks)
    assert joined.readings() == [reading for block in blocks for reading in block.readings()]
    assert [one.thruster for one in joined.commands] == [1, 2]
    rows, times_s = joined.times()
    assert (np.diff(rows) >= 0).all()
    assert times_s.tolist() == [reading.time_s for reading in joined.readings()]
    assert joined.rows == rows[-1] + 1


@pytest.mark.parametrize("row", range(10))
def test_a_split_block_joined_again_is_the_same(row):
    whole = ReadingBlock.joined([block_of(10.0, 1), block_of(20.0, 2)])
    before, after = whole.split(row)
    assert before.readings() + after.readings() == whole.readings()
    assert before.rows <= row
    assert all(len(one.row) for part in (before, after) for one in (*part.commands, *part.reports))


def test_nothing_is_no_reading():
    assert not ReadingBlock()
    assert ReadingBlock.joined([]).readings() == []
    assert ReadingBlock().rows == 0
    assert ReadingBlock.of([LinkState(3.0, "can0", True, "")])
