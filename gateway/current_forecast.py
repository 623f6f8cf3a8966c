"""A current forecast out of a NetCDF file, as a model of the flow round a dive."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from math import cos, degrees, inf
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from detectors.speed.gridded_flow import GriddedFlow
from gateway.cf_conventions import axes, depth_m, metres_per_second, unix_s, velocities
from gateway.local_frame import LocalFrame

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

RADIUS_M = 10_000.0
# No tide runs faster: what does is a mark for a missing value that the file does not declare.
SPEED_MAX_MPS = 15.0
# No model of currents is coarser: nodes farther apart are the two ends of a grid that lies elsewhere.
SPACING_MAX_DEG = 5.0
METRES_PER_DEGREE = 110_000.0  # of latitude, at the least


class ForecastError(ValueError):
    """A forecast that cannot be used: the file, what is wrong with it, and what would be right."""


@dataclass(frozen=True, slots=True)
class _Dive:
    """Where and when the forecast is wanted."""

    origin: LocalFrame
    radius_m: float
    start_s: float
    stop_s: float

    def __post_init__(self) -> None:
        if not self.radius_m > 0:
            raise ValueError(f"radius_m = {self.radius_m!r}: want above 0")
        if not self.start_s <= self.stop_s:
            raise ValueError(f"stop_s = {self.stop_s!r}: want start_s = {self.start_s!r} or later")


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """Nodes that rise, and where in the file each of them stands. Without a dimension in the file: one node."""

    dimension: Hashable | None
    indices: NDArray[np.intp]
    nodes: FloatArray

    @classmethod
    def rising(cls, coordinate: xr.DataArray, nodes: FloatArray) -> _Axis:
        """The nodes in order; of two alike, as in forecasts put end to end, the first."""
        values, indices = np.unique(nodes, return_index=True)
        known = np.isfinite(values)
        return cls(coordinate.dims[0], indices[known], values[known])

    def between(self, low: float, high: float) -> _Axis:
        """The nodes from `low` to `high`, and the next one to either side."""
        first = max(int(np.searchsorted(self.nodes, low, side="right")) - 1, 0)
        stop = int(np.searchsorted(self.nodes, high, side="left")) + 1
        return _Axis(self.dimension, self.indices[first:stop], self.nodes[first:stop])


ONE_NODE = _Axis(None, np.zeros(1, dtype=np.intp), np.zeros(1))


def load_forecast(
    path: Path,
    origin: LocalFrame,
    radius_m: float = RADIUS_M,
    *,
    variables: tuple[str, str] | None = None,
    start_s: float = -inf,
    stop_s: float = inf,
) -> GriddedFlow:
    """The currents of a file, in metres north and east of an origin, at unix times and depths.

    Only the part round the dive is read. Latitudes and longitudes become metres along the origin's own meridian and
    parallel, which is true to d^2 tan(latitude) / R at d from the origin: 27 m at 10 km and 60 degrees of latitude. A
    file without times is a steady current, one without depths a current of all depths.

    Args:
        path: NetCDF 3 or 4 by the CF conventions, on a grid of latitudes and longitudes.
        radius_m: how far from the origin the vehicle goes, north, south, east and west.
        variables: eastward and northward component by name; None: by their standard names.
        start_s, stop_s: unix times that the dive lies between.

    Raises:
        ForecastError: no such file, no reader for it, or nothing in it that can be used.
        ValueError: a radius or a span of time that is none.
    """
    dive = _Dive(origin, radius_m, start_s, stop_s)
    with _opened(path) as dataset:
        try:
            return _flow(dataset, variables, dive)
        except (OSError, ValueError) as error:
            raise ForecastError(f"{path}: {error}") from error


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    try:
        import xarray as xr
    except ImportError as error:
        raise ForecastError(f'{path}: no reader for it: pip install ".[forecast]"') from error
    try:
        dataset = xr.open_dataset(path, decode_timedelta=False)
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise ForecastError(f"{path}: want a NetCDF file by the CF conventions: {reason}") from error
    with dataset:
        yield dataset


def _flow(dataset: xr.Dataset, variables: tuple[str, str] | None, dive: _Dive) -> GriddedFlow:
    east, north = velocities(dataset, variables)
    if set(east.dims) != set(north.dims):
        raise ValueError(f"{east.name} and {north.name} are on different grids: want them at the same nodes")
    coordinates = axes(east)
    latitudes, longitudes = _latitudes(coordinates["latitude"], dive), _longitudes(coordinates["longitude"], dive)
    north_m, east_m = _metres(latitudes, longitudes, dive.origin)
    times, levels = _times(coordinates.get("time"), dive), _levels(coordinates.get("down"))
    grid = (times, levels, latitudes, longitudes)
    velocity = np.stack([_read(component, grid) for component in (north, east)], axis=-1)
    velocity[np.isnan(velocity).any(axis=-1)] = np.nan
    return GriddedFlow(times.nodes, levels.nodes, north_m, east_m, velocity)


def _latitudes(coordinate: xr.DataArray, dive: _Dive) -> _Axis:
    """Nodes in degrees north of the origin."""
    centre = degrees(dive.origin.latitude_rad)
    nodes = np.asarray(coordinate.to_numpy(), dtype=float) - centre
    return _around(_Axis.rising(coordinate, nodes), dive.radius_m / METRES_PER_DEGREE, f"latitude {centre:.4f}")


def _longitudes(coordinate: xr.DataArray, dive: _Dive) -> _Axis:
    """Nodes in degrees east of the origin, wherever the file begins its turn of 360."""
    centre = degrees(dive.origin.longitude_rad)
    nodes = (np.asarray(coordinate.to_numpy(), dtype=float) - centre + 180) % 360 - 180
    reach_deg = dive.radius_m / METRES_PER_DEGREE / max(cos(dive.origin.latitude_rad), 1e-6)
    return _around(_Axis.rising(coordinate, nodes), min(reach_deg, 180), f"longitude {centre:.4f}")


def _around(axis: _Axis, reach_deg: float, centre: str) -> _Axis:
    near = axis.between(-reach_deg, reach_deg)
    around = len(near.nodes) > 1 and near.nodes[0] <= 0 <= near.nodes[-1]
    if not around or np.diff(near.nodes).max() > SPACING_MAX_DEG:
        raise ValueError(f"does not reach the origin, at {centre}: want a forecast that covers the dive")
    return near


def _metres(latitudes: _Axis, longitudes: _Axis, origin: LocalFrame) -> tuple[FloatArray, FloatArray]:
    """(Y,) and (X,): the nodes along the origin's meridian and along its parallel.

    Raises:
        ValueError: so near a pole that the others stand elsewhere, by more than half the way to their neighbours.
    """
    rows = origin.latitude_rad + np.radians(latitudes.nodes)
    columns = origin.longitude_rad + np.radians(longitudes.nodes)
    north_m = np.array([origin.metres(row, origin.longitude_rad)[0] for row in rows])
    east_m = np.array([origin.metres(origin.latitude_rad, column)[1] for column in columns])
    corners = [origin.metres(rows[i], columns[j]) for i in (0, -1) for j in (0, -1)]
    straight = [(north_m[i], east_m[j]) for i in (0, -1) for j in (0, -1)]
    bend_m = float(np.abs(np.subtract(corners, straight)).max())
    if not bend_m < min(np.diff(north_m).min(), np.diff(east_m).min()) / 2:
        raise ValueError(
            f"too near the pole: its grid bends by {bend_m:.0f} m round the dive; want a smaller radius_m"
        )
    return north_m, east_m


def _times(coordinate: xr.DataArray | None, dive: _Dive) -> _Axis:
    if coordinate is None:
        return ONE_NODE
    times = _Axis.rising(coordinate, unix_s(coordinate))
    near = times.between(dive.start_s, dive.stop_s)
    if len(near.nodes) < 2:
        known = ", ".join(map(_stamp, times.nodes[[0, -1]])) if len(times.nodes) else "none"
        raise ValueError(
            f"has too few times in the dive: want two or more that enclose it; first and last are {known}"
        )
    return near


def _levels(coordinate: xr.DataArray | None) -> _Axis:
    return ONE_NODE if coordinate is None else _Axis.rising(coordinate, depth_m(coordinate))


def _read(component: xr.DataArray, grid: Sequence[_Axis]) -> FloatArray:
    """(T, Z, Y, X) in m/s, NaN where the file has no value."""
    present = [axis for axis in grid if axis.dimension is not None]
    alone = [dimension for dimension in component.dims if dimension not in {axis.dimension for axis in present}]
    part = component.isel({axis.dimension: axis.indices for axis in present}).squeeze(alone)
    values = part.transpose(*(axis.dimension for axis in present)).to_numpy().astype(float)
    values *= metres_per_second(component)
    values[~(np.abs(values) <= SPEED_MAX_MPS)] = np.nan
    return values.reshape([len(axis.nodes) for axis in grid])


def coverage(flow: GriddedFlow) -> str:
    """What a forecast covers, in words."""
    spans = (
        " to ".join(map(_stamp, flow.time_s[[0, -1]])) if len(flow.time_s) > 1 else "at all times",
        f"{flow.down_m[0]:.0f} to {flow.down_m[-1]:.0f} m deep" if len(flow.down_m) > 1 else "at all depths",
        f"{flow.north_m[0] / 1000:.1f} to {flow.north_m[-1] / 1000:.1f} km north",
        f"{flow.east_m[0] / 1000:.1f} to {flow.east_m[-1] / 1000:.1f} km east of the origin",
    )
    return ", ".join(spans)


def why_unknown(flow: GriddedFlow, time_s: float) -> str | None:
    """Why a forecast knows no current at the origin at a unix time, in words; None where it does."""
    if np.isfinite(flow.velocity_mps(time_s, np.zeros(2))).all():
        return None
    if len(flow.time_s) > 1 and not flow.time_s[0] <= time_s <= flow.time_s[-1]:
        return f"its times, {' to '.join(map(_stamp, flow.time_s[[0, -1]]))}, do not include {_stamp(time_s)}"
    return "the nodes next to the origin have no currents: they are land, or values are missing"


def _stamp(time_s: float) -> str:
    return datetime.fromtimestamp(float(time_s), UTC).strftime("%Y-%m-%d %H:%MZ")
