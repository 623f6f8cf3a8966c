"""Readings as columns, in the order in which they would have come one by one."""

from __future__ import annotations

from math import nan

import numpy as np

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
