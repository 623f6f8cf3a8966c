"""Readers of public recordings of thrusters."""

from __future__ import annotations

import csv
from datetime import datetime
from itertools import groupby
from math import pi
from pathlib import Path

import numpy as np

from hil_tests.playback.series import ThrusterSeries

TANK_FULL_SCALE_V = 5.0  # the amplifier's input; the recorded runs stay within +-3 V


def read_ngs_tank(path: Path) -> dict[str, ThrusterSeries]:
    """Closed-loop runs of the NGS thruster in a test tank, by their names: 25 Hz, speed without a sign.

    Raises:
        OSError, KeyError, ValueError: the file is not there or not of that form.
    """
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: _tank_run(list(run)) for name, run in groupby(rows, key=lambda row: row["run"])}


def _tank_run(rows: list[dict[str, str]]) -> ThrusterSeries:
    time_s, command_v, speed_radps = (
        np.array([float(row[column]) for row in rows]) for column in ("time_s", "command_v", "speed_rad_s")
    )
    unknown = np.full(len(rows), np.nan)
    return ThrusterSeries(time_s, command_v / TANK_FULL_SCALE_V, speed_radps * 60.0 / (2.0 * pi), unknown, unknown)


def read_esc_bench(path: Path) -> ThrusterSeries:
    """A motor and propeller on a bench, from the log of alspitz's esc_test: about 100 Hz, from time 0.

    Of rows with one time stamp, the first counts.

    Raises:
        OSError, KeyError, ValueError: the file is not there or not of that form.
    """
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    time_s = np.array([datetime.strptime(row["Timestamp"], "%Y-%m-%d %H:%M:%S:%f").timestamp() for row in rows])
    first = np.diff(np.maximum.accumulate(time_s), prepend=-np.inf) > 0.0
    duty, speed_rpm, voltage_v, current_a = (
        np.array([float(row[column]) for row in rows])[first] for column in ("Duty", "RPM", "Batt. Volts", "Amps")
    )
    return ThrusterSeries(time_s[first] - time_s[0], duty / 100.0, speed_rpm, voltage_v, current_a)
