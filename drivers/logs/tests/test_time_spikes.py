"""A frame whose time alone is damaged is left out; whatever a clock or a bus may do is not."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from drivers.logs.time_spikes import CAUSE, without_spikes


def filtered(*blocks: tuple[str, list[float]]) -> tuple[list[tuple[str, list[float]]], DamageReport]:
    damage = DamageReport(records=sum(len(times) for _, times in blocks))
    given = (
        (name, FrameBlock.of([CanFrame(time_s, 1, b"", extended=False) for time_s in times]))
        for name, times in blocks
    )
    return [(name, block.time_s.tolist()) for name, block in without_spikes(given, damage)], damage


@pytest.mark.parametrize("wrong_s", [-1e9, 3.0, 12.0, 9e9])
def test_a_frame_apart_is_left_out(wrong_s):
    kept, damage = filtered(("can0", [10.0, 10.1, wrong_s, 10.2, 10.3]))
    assert kept == [("can0", [10.0, 10.1, 10.2, 10.3])]
    assert damage.lost == {CAUSE: 1}
    assert damage.places[CAUSE] == [f"can0 at {wrong_s} s"]
    assert damage.records == 4


@pytest.mark.parametrize(
    "times",
    [
        [0.0, 0.1, 50.0, 50.1],  # the clock was set, or the bus was silent
        [50.0, 50.1, 0.0, 0.1],
        [0.0, 20.0, 40.0, 60.0],  # a rare frame
        [0.0, 0.9, 0.1, 1.0],  # from two queues
        [5.0],
    ],
)
def test_clocks_that_are_set_and_silence_cost_no_frame(times):
    kept, damage = filtered(("can0", times))
    assert kept == [("can0", times)]
    assert damage.lost == {}


def test_blocks_go_on_and_interfaces_are_apart():
    kept, _ = filtered(("can0", [1.0, 1.1]), ("can1", [70.0, 70.1]), ("can0", [99.0, 1.2]), ("can1", [70.2]))
    assert kept == [("can0", [1.0, 1.1]), ("can1", [70.0, 70.1]), ("can0", [1.2]), ("can1", [70.2])]


def test_no_digit_of_the_time_costs_another_frame(tmp_path):
    lines = [f"(16000000{number // 10:02}.{number % 10}00000) can0 123#00" for number in range(40)]
    path = tmp_path / "log"
    for place in range(1, 18):
        changed = [*lines[:20], lines[20][:place] + "7" + lines[20][place + 1 :], *lines[21:]]
        path.write_text("".join(line + "\n" for line in changed))
        damage = DamageReport()
        times = np.concatenate([block.time_s for _, block in open_can_log(path, damage)])
        assert 39 <= len(times) == damage.records
        assert np.all(np.diff(times) > -1.0)
