"""Recordings come out as recorded; a current and a loss are added to them exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hil_tests.missions import Drive, carried, read_kvlcc2, read_snapir

DATA = Path(__file__).parents[4] / "shared" / "data"
KVLCC2 = sorted(DATA.glob("kvlcc2/*.dat"))
SNAPIR = sorted(DATA.glob("snapir/*.npz"))
needs_data = pytest.mark.skipif(
    not (KVLCC2 and SNAPIR), reason="the recordings of shared/data are not beside the project"
)

TIME_S = np.arange(0.0, 300.0, 0.5)
TURNING_RAD = 0.4 * np.sin(TIME_S / 20.0)
SHIP = Drive(
    name="a ship",
    time_s=TIME_S,
    through_mps=3.0 * np.column_stack([np.cos(TURNING_RAD), np.sin(TURNING_RAD), np.zeros(len(TIME_S))]),
    heading_rad=TURNING_RAD,
    pitch_rad=np.zeros(len(TIME_S)),
    down_m=np.full(len(TIME_S), 4.0),
)


def carried_ship(**arguments):
    return carried(
        SHIP, **{"water": "constant", "flow_mps": 0.8, "noise_m": 0.0, "seed": 5, "onset_s": 200.0, **arguments}
    )


@needs_data
def test_the_ship_models_tracks_are_those_of_the_recording():
    assert len(KVLCC2) == 4
    for path in KVLCC2:
        ship = read_kvlcc2(path)
        still = carried(ship, "constant", 0.0, noise_m=0.0, seed=0, onset_s=0.0)
        printed = np.array([line.split() for line in path.read_text().splitlines()[3:] if line.strip()], dtype=float)
        assert ship.time_s[-1] == pytest.approx(printed[-1, 0], abs=1.0)
        np.testing.assert_allclose(still.true_position_m[:, 0], printed[:, 1] - printed[0, 1], atol=8.0)
        np.testing.assert_allclose(still.true_position_m[:, 1], printed[:, 2] - printed[0, 2], atol=2.0)
        assert ship.speed_mps[0] == pytest.approx(8.0, abs=0.2)
        assert 5.0 < ship.speed_mps.min() < 7.2


@needs_data
def test_the_auvs_tracks_are_those_of_the_recording():
    assert len(SNAPIR) == 11
    for path in SNAPIR:
        drive = read_snapir(path)
        still = carried(drive, "constant", 0.0, noise_m=0.0, seed=0, onset_s=0.0)
        with np.load(path) as file:
            rows = file["reference"][: len(drive.time_s)]
        north_m = 6.36e6 * (rows[:, 1] - rows[0, 1])
        east_m = 6.385e6 * np.cos(rows[0, 1]) * (rows[:, 2] - rows[0, 2])
        np.testing.assert_allclose(still.true_position_m, np.column_stack([north_m, east_m]), atol=20.0)
        assert 0.8 < drive.speed_mps.min() <= drive.speed_mps.max() < 2.9
        assert drive.down_m.min() >= 1.0


@pytest.mark.parametrize("water", ["constant", "tidal"])
def test_a_current_carries_the_ship_along(water):
    still, moved = carried_ship(flow_mps=0.0), carried_ship(water=water)
    carried_m = moved.true_position_m - still.true_position_m
    np.testing.assert_allclose(np.gradient(carried_m, TIME_S, axis=0)[5:-5], moved.true_flow_mps[5:-5], atol=1e-6)
    assert np.hypot(*moved.true_flow_mps.T).max() <= 0.8 * (1.0 + 1e-9)
    assert (np.ptp(moved.true_flow_mps) > 1e-6) or water == "constant"


def test_a_loss_scales_the_way_through_the_water():
    healthy, faulty = carried_ship(flow_mps=0.0), carried_ship(flow_mps=0.0, loss=0.3)
    assert np.isnan(healthy.onset_s)
    assert faulty.onset_s == 200.0
    steps_m = [np.hypot(*np.diff(way.true_position_m, axis=0).T) for way in (healthy, faulty)]
    settled = TIME_S[1:] > 203.0
    np.testing.assert_allclose(steps_m[1][settled] / steps_m[0][settled], 0.7, rtol=1e-6)
    np.testing.assert_allclose(faulty.true_speed_mps[TIME_S > 202.0], 2.1, rtol=1e-6)
    np.testing.assert_array_equal(steps_m[0][TIME_S[1:] <= 200.0], steps_m[1][TIME_S[1:] <= 200.0])


def test_the_normal_speed_is_what_the_healthy_hull_made():
    faulty = carried_ship(loss=0.3)
    assert (faulty.speed_min_mps, faulty.speed_max_mps) == pytest.approx((2.7, 3.3))


def test_noise_and_current_are_of_the_seed():
    one, again, another = (
        carried_ship(noise_m=0.5),
        carried_ship(noise_m=0.5, loss=0.3),
        carried_ship(noise_m=0.5, seed=6),
    )
    np.testing.assert_array_equal(
        one.north_m - one.true_position_m[:, 0], again.north_m - again.true_position_m[:, 0]
    )
    assert (one.north_m - one.true_position_m[:, 0]).std() == pytest.approx(0.5, rel=0.1)
    assert np.abs(one.true_flow_mps - another.true_flow_mps).max() > 0.01


def test_speed_is_the_part_along_the_axis_of_the_hull():
    """Dives at 30 degrees, with a slip that is no speed."""
    heading_rad, pitch_rad = 1.0, np.radians(-30.0)
    axis = np.array([np.cos(1.0) * np.cos(pitch_rad), np.sin(1.0) * np.cos(pitch_rad), -np.sin(pitch_rad)])
    aside = np.array([-np.sin(1.0), np.cos(1.0), 0.0])
    ones = np.ones(5)
    drive = Drive(
        "", np.arange(5.0), np.tile(2.0 * axis + 0.3 * aside, (5, 1)), heading_rad * ones, pitch_rad * ones, ones
    )
    np.testing.assert_allclose(drive.speed_mps, 2.0)


@pytest.mark.parametrize(
    ("arguments", "named"), [({"loss": 1.0}, "loss"), ({"loss": 0.3, "onset_s": 400.0}, "onset_s")]
)
def test_arguments_out_of_range_are_named(arguments, named):
    with pytest.raises(ValueError, match=named):
        carried_ship(**arguments)
