"""What the attributes of a NetCDF file say of its currents: names, axes and units by the CF conventions, 1.11.

Files in the wild are taken as far as they can be understood: standard names first, then units, then the axis
attribute, which of all is most often wrong. Names of variables mean nothing.
"""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
AxisKind = Literal["time", "down", "latitude", "longitude"]

NAME_THEM = "name the two to take by speed.flow.eastward and speed.flow.northward"

# Standard names of the components towards east and north, as they are preferred. On a grid of latitudes and
# longitudes x is east and y is north.
VELOCITIES = tuple(
    (prefix + east, prefix + north)
    for prefix in ("", "surface_", "barotropic_")
    for east, north in (
        ("eastward_sea_water_velocity", "northward_sea_water_velocity"),
        ("sea_water_x_velocity", "sea_water_y_velocity"),
    )
)

_STANDARD_NAMES: Mapping[str, AxisKind] = {
    "time": "time",
    "depth": "down",
    "height": "down",
    "altitude": "down",
    "latitude": "latitude",
    "longitude": "longitude",
}
_AXES: Mapping[str, AxisKind] = {"T": "time", "Z": "down", "Y": "latitude", "X": "longitude"}
_LATITUDE = re.compile(r"degrees?_?n(orth)?", re.IGNORECASE)
_LONGITUDE = re.compile(r"degrees?_?e(ast)?", re.IGNORECASE)
_METRES = re.compile(r"m|met(er|re)s?", re.IGNORECASE)
_SECOND = r"(s|secs?|seconds?)"
_SPEED = re.compile(
    rf"(?P<hundredth>c|centi)?(m|met(er|re)s?)(\s*/\s*{_SECOND}|[\s.*]*{_SECOND}\s*(\^|\*\*)?-1)", re.IGNORECASE
)
_UNIX_EPOCH = np.datetime64(0, "us")
_MICROSECOND = np.timedelta64(1, "us")


def velocities(dataset: xr.Dataset, variables: tuple[str, str] | None = None) -> tuple[xr.DataArray, xr.DataArray]:
    """The eastward and the northward component: the variables of these names, or those whose standard names say so.

    Raises:
        ValueError: none, or several alike.
    """
    if variables is not None:
        absent = [name for name in variables if name not in dataset]
        if absent:
            raise ValueError(f"has no variable {absent[0]!r}: want two of {_listed(dataset)}")
        return dataset[variables[0]], dataset[variables[1]]
    for names in VELOCITIES:
        east, north = (_of_standard_name(dataset, name) for name in names)
        if len(east) > 1 or len(north) > 1:
            raise ValueError(f"several currents alike, {_listed(east + north)}: {NAME_THEM}")
        if east and north:
            return dataset[east[0]], dataset[north[0]]
    raise ValueError(
        f"no variables with the standard names {VELOCITIES[0][0]} and {VELOCITIES[0][1]} or their like:"
        f" {NAME_THEM}, of {_listed(dataset)}"
    )


def _of_standard_name(dataset: xr.Dataset, name: str) -> list[Hashable]:
    return [key for key, variable in dataset.data_vars.items() if str(variable.attrs.get("standard_name")) == name]


def _listed(names: Any) -> str:
    return ", ".join(map(str, names)) or "nothing"


def axes(component: xr.DataArray) -> dict[AxisKind, xr.DataArray]:
    """The coordinates along the dimensions of a velocity; dimensions of one node that say nothing are left out.

    Raises:
        ValueError: not a grid along latitudes and longitudes, a dimension that means something else, one time only.
    """
    found: dict[AxisKind, xr.DataArray] = {}
    for dimension, nodes in component.sizes.items():
        coordinate = component.coords.get(dimension)
        kind = None if coordinate is None else axis_kind(coordinate)
        if kind is not None and coordinate is not None and kind not in found:
            found[kind] = coordinate
        elif nodes > 1:
            raise ValueError(_odd_dimension(component, dimension))
    missing = {"latitude", "longitude"} - found.keys()
    if missing:
        raise ValueError(f"{component.name} does not vary with {' or '.join(sorted(missing))}: want a grid of both")
    if "time" not in found and any(axis_kind(each) == "time" for each in component.coords.values()):
        raise ValueError(f"{component.name} is of one time only: want two or more times that enclose the dive")
    return found


def axis_kind(coordinate: xr.DataArray) -> AxisKind | None:
    """What a coordinate counts; None where its attributes do not tell."""
    attributes = {key: str(value) for key, value in coordinate.attrs.items()}
    units = attributes.get("units", "")
    # sigma levels, projected coordinates and reference times have an axis, too
    if "standard_name" in attributes:
        return _STANDARD_NAMES.get(attributes["standard_name"])
    if np.issubdtype(coordinate.dtype, np.datetime64):
        return "time"
    if _LATITUDE.fullmatch(units):
        return "latitude"
    if _LONGITUDE.fullmatch(units):
        return "longitude"
    if "positive" in attributes and _METRES.fullmatch(units):
        return "down"
    return _AXES.get(attributes.get("axis", ""))


def _odd_dimension(component: xr.DataArray, dimension: Hashable) -> str:
    flat = [
        name for name, each in component.coords.items() if axis_kind(each) == "latitude" and name not in each.dims
    ]
    if flat:
        shape = "curvilinear" if component.coords[flat[0]].ndim > 1 else "unstructured"
        return (
            f"{component.name} is on a {shape} grid: want one of rising latitudes and longitudes;"
            " regrid it, for example by `cdo remapbil,GRID IN OUT`"
        )
    return (
        f"dimension {dimension} of {component.name} is by its attributes none of time, depth in metres, latitude and"
        " longitude: give it a standard_name, take one of its nodes, or interpolate to depths"
    )


def metres_per_second(component: xr.DataArray) -> float:
    """How many m/s one unit of a velocity is.

    Raises:
        ValueError: its units are none of a speed.
    """
    units = component.attrs.get("units")
    match = _SPEED.fullmatch(str(units).strip())
    if match is None:
        raise ValueError(f"units of {component.name} = {units!r}: want m s-1 or cm s-1")
    return 0.01 if match["hundredth"] else 1.0


def unix_s(coordinate: xr.DataArray) -> FloatArray:
    """(T,) unix times; NaN where there is none.

    Raises:
        ValueError: no times of the usual calendar.
    """
    if not np.issubdtype(coordinate.dtype, np.datetime64):
        raise ValueError(
            f"{coordinate.name} is no time of the standard calendar: want units such as hours since 1950-01-01"
        )
    times = coordinate.to_numpy()
    return np.where(np.isnat(times), np.nan, (times - _UNIX_EPOCH) / _MICROSECOND * 1e-6)


def depth_m(coordinate: xr.DataArray) -> FloatArray:
    """(Z,) depths, down is positive.

    Raises:
        ValueError: not in metres, or all of them above the water.
    """
    units = str(coordinate.attrs.get("units", ""))
    if not _METRES.fullmatch(units):
        raise ValueError(f"units of {coordinate.name} = {units!r}: want depths in m")
    usual = "down" if coordinate.attrs.get("standard_name", "depth") == "depth" else "up"
    upwards = str(coordinate.attrs.get("positive", usual)).lower() == "up"
    depths = np.asarray(coordinate.to_numpy(), dtype=float) * (-1.0 if upwards else 1.0)
    if not (depths >= 0).any():
        raise ValueError(
            f"{coordinate.name} is above the water: want its attribute positive to be up or down, as it is"
        )
    return depths
