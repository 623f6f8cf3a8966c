"""Recorded dives for the navigation watch: to train its predictor on, and to measure it with.

A recording is a NumPy archive (numpy.savez_compressed) of these arrays, one row for each sample, times in seconds
and rising from row to row, all on one clock, nothing missing (leave out rows where the DVL had no lock):

    imu        (N, 7)   time; specific force forward, right, down, m/s2
                        (level and at rest 0, 0, -9.8); angular rate, rad/s
    dvl        (M, 4)   time; velocity over ground forward, right, down, m/s
    depth      (K, 2)   time; depth, m. Where it is left out, the altitude of
                        the reference is taken
    reference  (R, 10)  time; latitude, longitude, rad; altitude, m (negative
                        below the surface); velocity north, east, down, m/s;
                        roll, pitch, yaw, rad

The reference is the best that is known of the dive, such as the autopilot's own estimate. Where nothing is compared
with it, only its first row is used: where the dive began. Without a reference the dive's first seconds must do.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from detectors.navigation import DepthSample, DvlSample, ImuSample, NavigationSample, NavigationState

FloatArray = NDArray[np.float64]

COLUMNS = {"imu": 7, "dvl": 4, "depth": 2, "reference": 10}


class NavigationDataError(ValueError):
    """A recording that cannot be used: the file, the array, the row, and what would be right."""


@dataclass(frozen=True, slots=True, eq=False)
class NavigationData:
    """What the navigation sensors of a vehicle said in one dive.

    Attributes:
        name: of the dive.
        imu: (N, 7) time_s, specific force (3) in m/s2 and angular rate (3) in rad/s, body forward-right-down.
        dvl: (M, 4) time_s, velocity over ground (3) in m/s, body forward-right-down.
        depth: (K, 2) time_s, depth in m.
        reference: (R, 10) time_s, latitude and longitude in rad, altitude in m, velocity north-east-down (3) in m/s,
            roll, pitch, yaw in rad; None where it is not known.

    Raises:
        ValueError: an array of another shape, a value that is not finite, or times that do not rise.
    """

    name: str
    imu: FloatArray
    dvl: FloatArray
    depth: FloatArray
    reference: FloatArray | None = None

    def __post_init__(self) -> None:
        for name, columns in COLUMNS.items():
            rows = getattr(self, name)
            if rows is not None:
                _check(name, rows, columns)

    @property
    def initial(self) -> NavigationState:
        """Where the reference says that the dive began.

        Raises:
            ValueError: there is no reference.
        """
        if self.reference is None:
            raise ValueError(f"{self.name}: no reference, so the initial state is unknown: want it in the recording")
        time_s, latitude_rad, longitude_rad, altitude_m, *rest = self.reference[0].tolist()
        velocity_mps, attitude_rad = (rest[0], rest[1], rest[2]), (rest[3], rest[4], rest[5])
        return NavigationState(time_s, latitude_rad, longitude_rad, -altitude_m, velocity_mps, attitude_rad)

    def samples(self) -> Iterator[NavigationSample]:
        """All samples in the order of their times; of equal times the IMU's first, then the DVL's."""
        imu = (ImuSample(t, (fx, fy, fz), (wx, wy, wz)) for t, fx, fy, fz, wx, wy, wz in self.imu.tolist())
        dvl = (DvlSample(t, (x, y, z)) for t, x, y, z in self.dvl.tolist())
        depth = (DepthSample(t, depth_m) for t, depth_m in self.depth.tolist())
        return heapq.merge(imu, dvl, depth, key=attrgetter("time_s"))


def read_navigation_data(path: Path) -> NavigationData:
    """A recording, named after its file.

    Raises:
        NavigationDataError: no such file, not a NumPy archive, or not the arrays that the head of this module lists.
    """
    try:
        with path.open("rb") as file, _archive(file) as archive:
            arrays = {name: _numbers(name, archive[name]) for name in COLUMNS if name in archive}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise NavigationDataError(f"{path}: {error}; want a NumPy archive (.npz) of numbers") from error
    try:
        return _recording(path.stem, arrays)
    except ValueError as error:
        raise NavigationDataError(f"{path}: {error}") from error


def _archive(file: BinaryIO) -> NpzFile:
    loaded = np.load(file)
    if not isinstance(loaded, NpzFile):
        raise ValueError("a single array")
    return loaded


def _numbers(name: str, array: NDArray[np.generic]) -> FloatArray:
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} is of type {array.dtype}")
    return array.astype(np.float64)


def _recording(name: str, arrays: dict[str, FloatArray]) -> NavigationData:
    reference = arrays.get("reference")
    if reference is not None:
        _check("reference", reference, COLUMNS["reference"])
        arrays.setdefault("depth", reference[:, [0, 3]] * (1.0, -1.0))
    for wanted in ("imu", "dvl", "depth"):
        if wanted not in arrays:
            raise ValueError(f"{wanted}: missing: want an array (N, {COLUMNS[wanted]})")
    return NavigationData(name, arrays["imu"], arrays["dvl"], arrays["depth"], reference)


def _check(name: str, rows: FloatArray, columns: int) -> None:
    if rows.ndim != 2 or rows.shape[1] != columns or not len(rows):
        raise ValueError(f"{name}: shape {rows.shape}: want (N, {columns}), one row or more")
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(broken):
        row = int(broken[0])
        raise ValueError(f"{name}: row {row} = {rows[row].tolist()}: want finite numbers; leave the row out")
    back = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(back):
        row = int(back[0]) + 1
        before_s, time_s = rows[row - 1 : row + 1, 0].tolist()
        raise ValueError(f"{name}: row {row}: time {time_s} after {before_s}: want times that rise")
