"""Recorded ways of real hulls, with a current added and a loss of speed imposed.

Both recordings are healthy and say how the hull moved over ground. Here that counts as its motion through the water:
exact for the ship model, which sailed by itself in still water; for the AUV the real current, a few decimetres per
second at most, is part of what is called its speed here. A current is added to it by integrating both; a loss scales
the motion through the water from its onset on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil_tests.missions.passage import Passage, remaining
from hil_tests.missions.water import WaterKind, carry, random_water

FloatArray = NDArray[np.float64]

KVLCC2_STEP_S = 0.1353  # the time stamps are printed with three digits only
SURFACED_M = 1.0  # the AUV is not driven any more when it has come up to here
RAMP_S = 2.0
MARGIN = 0.1  # a speed this much outside what the healthy hull made is not normal
NOISE_STREAM, WATER_STREAM = 0, 1


@dataclass(frozen=True, eq=False)
class Drive:
    """How a hull moved through the water.

    Attributes:
        name: of the recording.
        time_s: (N,) at a constant step.
        through_mps: (N, 3) velocity through the water, north, east, down.
        heading_rad, pitch_rad, down_m: (N,)
    """

    name: str
    time_s: FloatArray
    through_mps: FloatArray
    heading_rad: FloatArray
    pitch_rad: FloatArray
    down_m: FloatArray

    @cached_property
    def speed_mps(self) -> FloatArray:
        """(N,) the part of the velocity along the hull's axis."""
        level = np.cos(self.pitch_rad)
        axis = [np.cos(self.heading_rad) * level, np.sin(self.heading_rad) * level, -np.sin(self.pitch_rad)]
        return np.asarray((self.through_mps * np.column_stack(axis)).sum(axis=1))


def read_kvlcc2(path: Path) -> Drive:
    """A zig-zag of the tanker model KVLCC2 (SIMMAN 2008, MARIN), at full scale.

    Raises:
        OSError, ValueError: the file is not there or not of that form.
    """
    lines = path.read_text(encoding="ascii").splitlines()[3:]
    rows = np.array([line.split() for line in lines if line.strip()], dtype=float)
    level = np.zeros(len(rows))
    return Drive(
        name=path.stem.removeprefix("MARIN_FREE_KVLCC2_"),
        time_s=np.arange(float(len(rows))) * KVLCC2_STEP_S,
        through_mps=np.column_stack([rows[:, 5], rows[:, 6], level]),
        heading_rad=np.radians(rows[:, 4]),
        pitch_rad=level,
        down_m=level,
    )


def read_snapir(path: Path) -> Drive:
    """The reference track of a dive of AUV Snapir, 1 Hz, until it surfaces.

    Raises:
        OSError, KeyError, ValueError: the file is not there or not of that form.
    """
    with np.load(path) as file:
        rows = np.asarray(file["reference"], dtype=float)
    surfaced = np.flatnonzero(-rows[:, 3] < SURFACED_M)
    rows = rows[: surfaced[0]] if len(surfaced) else rows
    return Drive(
        name=path.stem,
        time_s=rows[:, 0] - rows[0, 0],
        through_mps=rows[:, 4:7],
        heading_rad=np.unwrap(rows[:, 9]),
        pitch_rad=rows[:, 8],
        down_m=-rows[:, 3],
    )


def carried(
    drive: Drive, water: WaterKind, flow_mps: float, *, noise_m: float, seed: int, loss: float = 0.0, onset_s: float
) -> Passage:
    """The drive in water that moves, as positions with white noise.

    The normal speed is what the healthy hull made in the whole recording, a tenth down and up: in turns a hull
    slows down by itself, and the commands are not recorded.

    Args:
        drive: how the hull moves through the water.
        water, flow_mps: kind and greatest speed of the current; its direction and the noise are drawn from `seed`.
        noise_m: standard deviation of a position.
        seed: 0 or more; with another loss it is still the same current and noise.
        loss: lasting relative loss of speed, 0.0 for none.
        onset_s: when it begins.

    Raises:
        ValueError: loss or onset out of range.
    """
    if not 0.0 <= loss < 1.0:
        raise ValueError(f"loss = {loss}: want 0 or more, below 1")
    if loss and not 0.0 < onset_s < drive.time_s[-1]:
        raise ValueError(f"onset_s = {onset_s}: want a time within the {drive.time_s[-1]:.0f} s of {drive.name}")
    left = remaining(drive.time_s, loss, onset_s, RAMP_S)
    through_mps = left[:, np.newaxis] * drive.through_mps[:, :2]
    current = random_water(
        np.random.default_rng([seed, WATER_STREAM]), water, flow_mps, drive.time_s, np.zeros_like(through_mps)
    )
    position_m, current_mps = carry(current, drive.time_s, through_mps)
    seen_m = position_m + noise_m * np.random.default_rng([seed, NOISE_STREAM]).standard_normal(position_m.shape)
    return Passage(
        kind=drive.name,
        time_s=drive.time_s,
        north_m=seen_m[:, 0],
        east_m=seen_m[:, 1],
        down_m=drive.down_m,
        heading_rad=drive.heading_rad,
        pitch_rad=drive.pitch_rad,
        true_position_m=position_m,
        true_heading_rad=drive.heading_rad,
        true_speed_mps=left * drive.speed_mps,
        true_flow_mps=current_mps,
        speed_min_mps=(1.0 - MARGIN) * float(drive.speed_mps.min()),
        speed_max_mps=(1.0 + MARGIN) * float(drive.speed_mps.max()),
        loss=loss,
        onset_s=onset_s if loss else float("nan"),
        noise_m=noise_m,
        rate_hz=1.0 / (drive.time_s[1] - drive.time_s[0]),
    )
