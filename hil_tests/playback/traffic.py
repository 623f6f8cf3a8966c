"""Series as frames of a DroneCAN bus, each stamped with the time at which it is due."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.dronecan.setpoints import COMMAND_MAX
from drivers.can.frame import CanFrame
from hil_tests.playback.series import ThrusterSeries

AUTOPILOT_NODE = 10
FIRST_ESC_NODE = 11


def dronecan_traffic(series: Mapping[int, ThrusterSeries]) -> list[CanFrame]:
    """The bus on which these thrusters were commanded and reported, in order of time.

    Every sample of a series becomes an esc.RawCommand of the autopilot, with the newest commands of all ESCs, and an
    esc.Status of its own node.

    Args:
        series: by ESC index, from 0; all from one origin of time.

    Returns:
        Frames; their `time_s` is that of the sample.
    """
    instants = sorted(
        (float(time_s), index, row) for index, one in series.items() for row, time_s in enumerate(one.time_s)
    )
    commands = [0] * (max(series) + 1)
    command_ids, status_ids = count(), {index: count() for index in series}
    frames: list[CanFrame] = []
    for time_s, index, row in instants:
        commands[index] = round(COMMAND_MAX * float(series[index].command[row]))
        frames += encode_raw_command(commands, AUTOPILOT_NODE, next(command_ids) % 32, time_s=time_s)
        status = _status(series[index], index, row)
        frames += encode_esc_status(status, FIRST_ESC_NODE + index, next(status_ids[index]) % 32, time_s=time_s)
    return frames


def _status(series: ThrusterSeries, index: int, row: int) -> EscStatus:
    return EscStatus(
        error_count=0,
        voltage_v=float(series.voltage_v[row]),
        current_a=float(series.current_a[row]),
        temperature_k=float("nan"),
        speed_rpm=round(float(series.speed_rpm[row])),
        power_percent=0,
        esc_index=index,
    )
