"""Current forecasts from NetCDF files, in the dialects that their makers write."""

from __future__ import annotations

import builtins
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gateway.current_forecast import ForecastError, coverage, load_forecast, why_unknown
from gateway.local_frame import LocalFrame

KIEL = (54.47, 10.25)
FIJI = (-16.8, 179.97)
START = np.datetime64("2026-11-22T00:00", "ns")
START_S = float(START.astype("datetime64[s]").astype(int))
HOURS = np.arange(7)
LEVELS = np.array([0.5, 5.0, 20.0])


def truth(hours: Any, depth: Any, latitude: Any, longitude: Any) -> tuple[Any, Any]:
    """North and east: linear, so that a linear interpolation of it has no error of its own."""
    north = 0.20 + 0.03 * hours - 0.004 * depth + 0.8 * latitude + 0.3 * longitude
    east = -0.10 + 0.02 * hours + 0.002 * depth - 0.5 * latitude + 0.6 * longitude
    return north, east


def dataset(origin: tuple[float, float], span_deg: float = 0.5, step_deg: float = 0.1) -> xr.Dataset:
    """Currents round an origin as the Copernicus Marine Service names them; `truth` of degrees from the origin."""
    offsets = np.arange(-span_deg, span_deg + step_deg / 2, step_deg) + step_deg / 3
    hours, depth, latitude, longitude = np.meshgrid(HOURS, LEVELS, offsets, offsets, indexing="ij")
    north, east = truth(hours, depth, latitude, longitude)
    dimensions = ("time", "depth", "latitude", "longitude")
    speed = {"units": "m s-1"}
    return xr.Dataset(
        {
            "uo": (dimensions, east, speed | {"standard_name": "eastward_sea_water_velocity"}),
            "vo": (dimensions, north, speed | {"standard_name": "northward_sea_water_velocity"}),
            "thetao": (dimensions, 8 + 0 * east, {"units": "degrees_C"}),
        },
        {
            "time": ("time", START + HOURS * np.timedelta64(1, "h"), {"standard_name": "time", "axis": "T"}),
            "depth": ("depth", LEVELS, {"standard_name": "depth", "units": "m", "positive": "down", "axis": "Z"}),
            "latitude": ("latitude", origin[0] + offsets, {"standard_name": "latitude", "units": "degrees_north"}),
            "longitude": (
                "longitude",
                (origin[1] + offsets + 180) % 360 - 180,
                {"standard_name": "longitude", "units": "degrees_east"},
            ),
        },
    )


def copernicus(path: Path, origin: tuple[float, float]) -> None:
    """NetCDF 4, float32, hours since 1950."""
    packed = {"dtype": "float32", "_FillValue": 1e20, "zlib": True}
    time = {"units": "hours since 1950-01-01", "dtype": "float64"}
    dataset(origin).to_netcdf(path, engine="h5netcdf", encoding={"uo": packed, "vo": packed, "time": time})


def hycom(path: Path, origin: tuple[float, float]) -> None:
    """NetCDF 4, packed integers, longitudes from 0 to 360 and so out of order, hours since 2000."""
    forecast = dataset(origin).rename(uo="water_u", vo="water_v", latitude="lat", longitude="lon")
    turned = forecast["lon"].copy(data=forecast["lon"].to_numpy() % 360)
    forecast = forecast.assign_coords(lon=turned).sortby("lon")
    packed = {"dtype": "int16", "scale_factor": 0.0005, "add_offset": 0.0, "_FillValue": -30000}
    time = {"units": "hours since 2000-01-01 00:00:00", "dtype": "float64"}
    encoding = {"water_u": packed, "water_v": packed, "time": time}
    forecast.to_netcdf(path, engine="h5netcdf", encoding=encoding)


def old_model(path: Path, origin: tuple[float, float]) -> None:
    """NetCDF 3, latitudes from the north, heights for depths, cm/s, axes mixed up, dimensions in an odd order."""
    forecast = dataset(origin).rename(uo="U", vo="V").drop_vars("thetao").isel(latitude=slice(None, None, -1))
    for name, axis in (("U", "x"), ("V", "y")):
        forecast[name] = forecast[name] * 100
        forecast[name].attrs |= {"units": "cm/s", "standard_name": f"sea_water_{axis}_velocity"}
    forecast = forecast.assign_coords(depth=-forecast["depth"])
    forecast["depth"].attrs |= {"standard_name": "height", "units": "meters", "positive": "up"}
    for name, axis in (("latitude", "X"), ("longitude", "Y")):
        forecast[name].attrs |= {"axis": axis}
    time = {"units": "days since 1990-01-01 00:00:00", "dtype": "float64"}
    forecast = forecast.transpose("longitude", "latitude", "time", "depth")
    forecast.to_netcdf(path, engine="scipy", encoding={"time": time})


def saved(path: Path, forecast: xr.Dataset) -> Path:
    forecast.to_netcdf(path, engine="h5netcdf")
    return path


@pytest.mark.parametrize("write", [copernicus, hycom, old_model])
@pytest.mark.parametrize("origin", [KIEL, FIJI, (0.02, 0.01)], ids=["Kiel", "date line", "Greenwich"])
def test_every_dialect_gives_the_same_currents(tmp_path, write, origin):
    write(tmp_path / "forecast.nc", origin)
    frame = LocalFrame.at_degrees(*origin)
    flow = load_forecast(tmp_path / "forecast.nc", frame, 8000.0)
    random = np.random.default_rng(3)
    for _ in range(50):
        hours, depth = random.uniform(0, HOURS[-1]), random.uniform(LEVELS[0], LEVELS[-1])
        north_m, east_m = random.uniform(-8000, 8000, 2)
        latitude, longitude = frame.degrees(north_m, east_m)
        wanted = truth(hours, depth, latitude - origin[0], (longitude - origin[1] + 180) % 360 - 180)
        told = flow.velocity_mps(START_S + 3600 * hours, np.array([north_m, east_m, depth]))
        assert told == pytest.approx([*wanted, 0.0], abs=1e-3)


def test_only_the_part_round_the_dive_is_kept(tmp_path):
    copernicus(tmp_path / "forecast.nc", KIEL)
    frame = LocalFrame.at_degrees(*KIEL)
    hour = 3600.0
    flow = load_forecast(
        tmp_path / "forecast.nc", frame, 500.0, start_s=START_S + 1.5 * hour, stop_s=START_S + 2 * hour
    )
    assert flow.grid_mps.shape == (2, 3, 2, 2, 2)
    assert [flow.time_s[0] - START_S, flow.time_s[-1] - START_S] == [hour, 2 * hour]
    assert coverage(flow).startswith("2026-11-22 01:00Z to 2026-11-22 02:00Z, 0 to 20 m deep, -7.")


def test_global_grid_is_taken_across_its_seam(tmp_path):
    latitudes, longitudes = np.arange(-80, 81.0), np.arange(0, 360.0)
    east, north = np.meshgrid(longitudes, latitudes)
    forecast = dataset(KIEL).isel(time=0, depth=0, drop=True).drop_dims(["latitude", "longitude"])
    for name, values in (("uo", np.minimum(east, 360 - east)), ("vo", north)):
        attributes = dataset(KIEL)[name].attrs
        forecast[name] = (("latitude", "longitude"), values / 100, attributes)
    forecast = forecast.assign_coords(
        latitude=("latitude", latitudes, {"units": "degrees_north"}),
        longitude=("longitude", longitudes, {"units": "degreeE"}),
    )
    flow = load_forecast(saved(tmp_path / "global.nc", forecast), LocalFrame.at_degrees(10.5, -0.25))
    assert flow.velocity_mps(0.0, np.array([0.0, 0.0, 200.0])) == pytest.approx([0.105, 0.0025, 0.0], abs=1e-6)
    assert "at all times, at all depths" in coverage(flow)


def test_surface_currents_have_no_depth_and_radar_no_value_at_some_nodes(tmp_path):
    forecast = dataset(KIEL).isel(depth=[0])
    for name, way in (("uo", "eastward"), ("vo", "northward")):
        forecast[name].attrs["standard_name"] = f"surface_{way}_sea_water_velocity"
    forecast = forecast.squeeze("depth", drop=True).expand_dims(ensemble=1)
    forecast["uo"][0, 3:] = 1.27e30  # what is said to be missing by its size only
    flow = load_forecast(saved(tmp_path / "radar.nc", forecast), LocalFrame.at_degrees(*KIEL))
    here = np.array([0.0, 0.0, 12.0])
    assert flow.velocity_mps(START_S + 3600, here) == pytest.approx([0.228, -0.079, 0.0], abs=1e-5)
    assert np.isnan(flow.velocity_mps(START_S + 4 * 3600, here)).all()


def test_what_a_forecast_does_not_know_is_said(tmp_path):
    forecast = dataset(KIEL).isel(depth=0, drop=True)
    forecast["vo"][5] = np.nan
    flow = load_forecast(saved(tmp_path / "forecast.nc", forecast), LocalFrame.at_degrees(*KIEL))
    assert why_unknown(flow, START_S + 3600) is None
    assert "2026-11-22 00:00Z to 2026-11-22 06:00Z, do not include 2026-11-22 06:01Z" in str(
        why_unknown(flow, START_S + 6 * 3600 + 60)
    )
    assert "land" in str(why_unknown(flow, START_S + 5 * 3600))


def without_leap_days(forecast: xr.Dataset) -> xr.Dataset:
    attributes = {"standard_name": "time", "units": "hours since 2026-01-01", "calendar": "noleap"}
    return forecast.assign_coords(time=("time", HOURS.astype(float), attributes))


def staggered(forecast: xr.Dataset) -> xr.Dataset:
    return forecast.drop_vars("thetao").assign(uo=forecast["uo"].rename(longitude="longitude_u"))


def curvilinear(forecast: xr.Dataset) -> xr.Dataset:
    latitudes, longitudes = np.meshgrid(forecast["latitude"], forecast["longitude"], indexing="ij")
    bare = forecast.rename(latitude="y", longitude="x").drop_vars(["y", "x"])
    return bare.assign_coords(
        lat=(("y", "x"), latitudes, {"units": "degrees_north"}),
        lon=(("y", "x"), longitudes, {"units": "degrees_east"}),
    )


def unstructured(forecast: xr.Dataset) -> xr.Dataset:
    nodes = forecast.drop_vars("thetao").stack(node=["latitude", "longitude"]).reset_index("node")
    nodes["latitude"].attrs["units"] = "degrees_north"
    return nodes


def sigma(forecast: xr.Dataset) -> xr.Dataset:
    forecast["depth"].attrs = {"standard_name": "ocean_sigma_coordinate", "positive": "up", "axis": "Z"}
    return forecast


def attribute(variable: str, **attributes: Any) -> Any:
    def change(forecast: xr.Dataset) -> xr.Dataset:
        forecast[variable].attrs |= attributes
        return forecast

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (attribute("uo", standard_name="eastward_wind"), "eastward_sea_water_velocity .* of uo, vo, thetao"),
        (
            attribute("thetao", standard_name="eastward_sea_water_velocity"),
            "several currents alike, uo, thetao, vo: .*speed.flow.eastward",
        ),
        (attribute("vo", units="1"), "units of vo = '1': want m s-1 or cm s-1"),
        (attribute("depth", positive="up"), "depth is above the water"),
        (attribute("depth", units="dbar"), "units of depth = 'dbar'"),
        (attribute("depth", standard_name="projection_z"), "dimension depth of uo is by its attributes none of"),
        # xarray decodes it where cftime is installed, and refuses it otherwise
        (without_leap_days, "time is no time of the standard calendar|calendar 'noleap'"),
        (staggered, "different grids"),
        (curvilinear, "curvilinear grid.*regrid it"),
        (unstructured, "unstructured grid.*regrid it"),
        (sigma, "dimension depth of uo is by its attributes none of"),
        (lambda forecast: forecast.isel(time=0), "uo is of one time only"),
        (lambda forecast: forecast.isel(time=[0]), "too few times in the dive.*2026-11-22 00:00Z"),
        (lambda forecast: forecast.isel(latitude=slice(2)), "does not reach the origin, at latitude 54.4700"),
        (lambda forecast: forecast.isel(latitude=0, drop=True), "does not vary with latitude"),
        (lambda forecast: forecast.assign_coords(longitude=forecast["longitude"] + 90), "longitude 10.2500"),
        (lambda forecast: forecast.assign_coords(time=("time", HOURS, {"axis": "T"})), "time is no time"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_file_and_the_way_out(tmp_path, change, said):
    path = saved(tmp_path / "forecast.nc", change(dataset(KIEL)))
    with pytest.raises(ForecastError, match=said) as refusal:
        load_forecast(path, LocalFrame.at_degrees(*KIEL))
    assert str(refusal.value).startswith(str(path))


def test_of_several_currents_the_named_ones_are_taken(tmp_path):
    forecast = dataset(KIEL)
    forecast["utotal"], forecast["vtotal"] = 2 * forecast["uo"], 2 * forecast["vo"]
    forecast["utotal"].attrs, forecast["vtotal"].attrs = forecast["uo"].attrs, forecast["vo"].attrs
    path, frame = saved(tmp_path / "forecast.nc", forecast), LocalFrame.at_degrees(*KIEL)
    flow = load_forecast(path, frame, variables=("utotal", "vtotal"))
    assert flow.velocity_mps(START_S, np.zeros(2)) == pytest.approx([0.396, -0.198], abs=1e-3)
    with pytest.raises(ForecastError, match="has no variable 'utot': want two of uo, vo"):
        load_forecast(path, frame, variables=("utot", "vtotal"))


def test_near_the_pole_a_grid_of_degrees_is_refused(tmp_path):
    forecast = dataset(KIEL).assign_coords(latitude=89.99 + np.linspace(-0.05, 0.005, 11))
    forecast["latitude"].attrs["units"] = "degrees_north"
    with pytest.raises(ForecastError, match="too near the pole"):
        load_forecast(saved(tmp_path / "pole.nc", forecast), LocalFrame.at_degrees(89.99, KIEL[1]))


@pytest.mark.parametrize("contents", [None, b"", b"time,u,v\n", b"\x89HDF\r\n\x1a\n broken"])
def test_file_that_is_none_is_refused(tmp_path, contents):
    path = tmp_path / "forecast.nc"
    if contents is not None:
        path.write_bytes(contents)
    with pytest.raises(ForecastError, match="want a NetCDF file"):
        load_forecast(path, LocalFrame.at_degrees(*KIEL))


def test_without_a_reader_the_way_out_is_said(monkeypatch):
    really_import = builtins.__import__

    def without_xarray(name: str, *arguments: Any, **keywords: Any) -> Any:
        if name == "xarray":
            raise ImportError(name)
        return really_import(name, *arguments, **keywords)

    monkeypatch.setattr(builtins, "__import__", without_xarray)
    with pytest.raises(ForecastError, match=r'pip install "\.\[forecast\]"'):
        load_forecast(Path("forecast.nc"), LocalFrame.at_degrees(*KIEL))


@pytest.mark.parametrize("span", [{"radius_m": 0.0}, {"start_s": 5.0, "stop_s": 4.0}])
def test_dive_without_room_or_time_is_the_callers_mistake(tmp_path, span):
    copernicus(tmp_path / "forecast.nc", KIEL)
    with pytest.raises(ValueError, match="want") as refusal:
        load_forecast(tmp_path / "forecast.nc", LocalFrame.at_degrees(*KIEL), **span)
    assert not isinstance(refusal.value, ForecastError)
