"""The missions are what they claim to be: ways, water, losses and sensors."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from hil_tests.missions import KINDS, random_mission
from hil_tests.missions.course import CIRCLE_S, TURN_RATE_DPS, random_course
from hil_tests.missions.fixes import Sensors, measured_positions, random_instants
from hil_tests.missions.mission import DURATION_S, FOUND_WITHIN_S, NOISE_M, SPEED_MPS
from hil_tests.missions.water import _KINDS, carry, random_water

STYLES = ("plain", "rough")
TIME_S = np.arange(0.0, 400.0, 0.05)


def same(one, other):
    return all(np.array_equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(one) if "_" in f.name)


@pytest.mark.parametrize("style", STYLES)
def test_a_mission_is_its_seed(style):
    for seed in range(5):
        mission = random_mission(seed, 0.3, style)
        again, another = random_mission(seed, 0.3, style), random_mission(seed + 100, 0.3, style)
        assert same(mission, again)
        assert mission.drawn["flow_mps"] != another.drawn["flow_mps"]


@pytest.mark.parametrize("style", STYLES)
def test_the_way_is_the_integral_of_the_speed_along_the_heading_and_of_the_flow(style):
    for seed in range(8):
        mission = random_mission(seed, 0.3, style, rate_hz=10.0)
        time_s, speed_mps, heading_rad = mission.time_s, mission.true_speed_mps, mission.true_heading_rad
        ahead = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
        right = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        slip_mps = -speed_mps * mission.drawn["slip_s"] * np.gradient(heading_rad, time_s)
        velocity_mps = mission.true_flow_mps + speed_mps[:, None] * ahead + slip_mps[:, None] * right
        steps_m = np.diff(mission.true_position_m, axis=0)
        expected_m = 0.5 * (velocity_mps[1:] + velocity_mps[:-1]) * np.diff(time_s)[:, None]
        close = np.diff(time_s) < 0.2  # over a gap the velocity is not known well enough
        off_mps = np.abs(steps_m - expected_m)[close] / np.diff(time_s)[close, None]
        assert off_mps.max() < 0.03 * mission.nominal_speed_mps  # at the corners of the ramp and of the turns
        assert np.median(off_mps) < 1e-3 * mission.nominal_speed_mps


@pytest.mark.parametrize("style", STYLES)
def test_a_loss_is_of_its_size_from_its_onset_on(style):
    for seed in range(8):
        healthy, faulty = random_mission(seed, 0.0, style), random_mission(seed, 0.3, style)
        assert np.isnan(healthy.onset_s)
        last_s = healthy.drawn["duration_s"]
        assert 0.5 * last_s <= faulty.onset_s <= last_s - FOUND_WITHIN_S
        ratio = faulty.true_speed_mps / healthy.true_speed_mps
        np.testing.assert_array_equal(ratio[healthy.time_s <= faulty.onset_s], 1.0)
        np.testing.assert_allclose(ratio[healthy.time_s > faulty.onset_s + 2.05], 0.7, rtol=1e-9)
        before = healthy.time_s < faulty.onset_s
        np.testing.assert_array_equal(healthy.north_m[before], faulty.north_m[before])
        np.testing.assert_array_equal(healthy.heading_rad, faulty.heading_rad)


@pytest.mark.parametrize("style", STYLES)
def test_healthy_speeds_vary_by_a_few_percent(style):
    for seed in range(12):
        mission = random_mission(seed, style=style)
        ratio = mission.true_speed_mps / mission.nominal_speed_mps
        assert 0.9 < ratio.min() <= ratio.max() < 1.05
        assert np.hypot(*mission.true_flow_mps.T).max() <= 1.5 * mission.nominal_speed_mps * (1.0 + 1e-9)


def test_missions_fill_their_ranges():
    missions = [random_mission(seed) for seed in range(40)]
    assert {mission.kind for mission in missions} == set(KINDS)
    assert {mission.drawn["water"] for mission in missions} == {"constant", "tidal", "spatial"}
    assert {mission.rate_hz for mission in missions} == {1.0, 2.0, 4.0, 5.0, 10.0}
    for values, (low, high) in (
        ([mission.noise_m for mission in missions], NOISE_M),
        ([mission.nominal_speed_mps for mission in missions], SPEED_MPS),
        ([mission.time_s[-1] for mission in missions], DURATION_S),
    ):
        assert low - 1.0 <= min(values) < low * 1.6
        assert high * 0.8 < max(values) <= high


def test_rough_missions_have_what_happens_as_well():
    missions = [random_mission(seed, style="rough") for seed in range(60)]
    assert {mission.drawn["water"] for mission in missions} == set(_KINDS)
    assert min(mission.nominal_speed_mps for mission in missions) < 0.1
    for name in ("correlated", "repeated", "outliers"):
        assert 8 < sum(mission.drawn[name] > 0.0 for mission in missions) < 60, name
    assert any(np.isfinite(mission.drawn["jump_s"]) for mission in missions)
    assert any(np.diff(mission.time_s).max() > 5.0 for mission in missions)
    assert all(np.all(np.diff(mission.time_s) > 0.0) for mission in missions)


@pytest.mark.parametrize("noise_m", [0.1, 2.0])
def test_another_sensor_sees_the_same_mission(noise_m):
    drawn, seen = random_mission(7, 0.3), random_mission(7, 0.3, noise_m=noise_m, rate_hz=10.0)
    both_s = np.intersect1d(np.round(drawn.time_s, 6), np.round(seen.time_s, 6))
    of_drawn, of_seen = (np.isin(np.round(m.time_s, 6), both_s) for m in (drawn, seen))
    np.testing.assert_allclose(drawn.true_position_m[of_drawn], seen.true_position_m[of_seen], atol=1e-6)
    errors_m = np.column_stack([seen.north_m, seen.east_m]) - seen.true_position_m
    assert errors_m.std(axis=0) == pytest.approx(noise_m, rel=0.05)
    assert errors_m.mean(axis=0) == pytest.approx(0.0, abs=4.0 * noise_m / np.sqrt(len(errors_m)))


def test_headings_are_off_by_noise_and_by_a_constant():
    mission = random_mission(3, rate_hz=10.0)
    error_rad = np.angle(np.exp(1j * (mission.heading_rad - mission.true_heading_rad)))
    assert error_rad.mean() == pytest.approx(mission.drawn["compass_error_rad"], abs=0.002)
    assert np.radians(0.95) < error_rad.std() < np.radians(2.05)
    assert np.abs(mission.heading_rad).max() <= np.pi


def test_a_loss_on_a_straight_leg_begins_where_the_vehicle_does_not_turn():
    for seed in range(10):
        mission = random_mission(seed, 0.3, rate_hz=10.0, on_straight=True)
        assert mission.kind != "circle"
        around = np.abs(mission.time_s - mission.onset_s + 1.0) < 1.0
        assert np.ptp(mission.true_heading_rad[around]) < np.radians(1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_courses_turn_as_fast_as_vehicles_do(kind):
    for seed in range(10):
        course = random_course(np.random.default_rng(seed), kind, TIME_S)
        fastest_dps = np.degrees(np.abs(course.yaw_rate_radps)).max()
        limit_dps = 360.0 / CIRCLE_S[0] if kind == "circle" else TURN_RATE_DPS[1]
        assert 3.0 <= fastest_dps <= limit_dps * 1.001
        share = course.straight[TIME_S > 10.0].mean()
        assert share == 0.0 if kind == "circle" else 0.2 < share < 0.98


def test_a_vehicle_in_an_eddy_goes_around():
    """Solid-body rotation has a closed answer: a circle around the centre, in the time of one turn."""
    turn_radps = 2.0 * np.pi / TIME_S[-1]

    def whirl(time_s, place_m):
        return turn_radps * np.column_stack([-(place_m[:, 1] - 50.0), place_m[:, 0]])

    position_m, flow_mps = carry(whirl, TIME_S, np.zeros((len(TIME_S), 2)))
    angle_rad = turn_radps * TIME_S
    expected_m = np.column_stack([50.0 * np.sin(angle_rad), 50.0 - 50.0 * np.cos(angle_rad)])
    np.testing.assert_allclose(position_m, expected_m, atol=1e-4)
    np.testing.assert_allclose(np.hypot(*flow_mps.T), 50.0 * turn_radps, rtol=1e-6)


@pytest.mark.parametrize("kind", _KINDS)
def test_water_is_smooth_and_never_faster_than_asked_for(kind):
    places_m = np.random.default_rng(0).uniform(-300.0, 300.0, (len(TIME_S), 2))
    for seed in range(10):
        water = random_water(np.random.default_rng(seed), kind, 1.2, TIME_S, np.column_stack([TIME_S, TIME_S]))
        assert np.hypot(*water(TIME_S, places_m).T).max() <= 1.2 * (1.0 + 1e-9)
        along = water(TIME_S, np.column_stack([TIME_S, 0.3 * TIME_S]))
        assert np.abs(np.diff(along, axis=0)).max() < 0.03  # a 20th of a second
        assert (np.ptp(along, axis=0).max() > 0.0) == (kind != "constant")


def test_fixes_go_wrong_as_told():
    rng = np.random.default_rng(0)
    still_m = np.zeros((4000, 2))
    time_s = np.arange(4000) / 4.0
    good = {"noise_m": 0.5, "heading_noise_rad": 0.0, "compass_error_rad": 0.0}
    repeated = measured_positions(rng, Sensors(**good, repeated=0.4), time_s, still_m)
    assert np.mean(np.diff(repeated[:, 0]) == 0.0) == pytest.approx(0.4, abs=0.03)
    outliers = measured_positions(rng, Sensors(**good, outliers=0.01), time_s, still_m)
    assert np.mean(np.hypot(*outliers.T) > 3.0) == pytest.approx(0.01, abs=0.005)
    jumped = measured_positions(rng, Sensors(**good, jump_s=600.0), time_s, still_m)
    assert np.hypot(*(jumped[time_s > 600.0].mean(axis=0) - jumped[time_s <= 600.0].mean(axis=0))) > 4.5
    wandering = measured_positions(rng, Sensors(**good, correlated=0.5, correlation_s=10.0), time_s, still_m)
    assert wandering.std() == pytest.approx(0.5, rel=0.15)
    assert np.corrcoef(wandering[1:, 0], wandering[:-1, 0])[0, 1] == pytest.approx(0.5 * np.exp(-0.025), abs=0.1)


def test_even_instants_are_even():
    time_s = random_instants(np.random.default_rng(0), 4.0, 300.0, rough=False)
    np.testing.assert_allclose(np.diff(time_s), 0.25)
    assert len(time_s) == 1200


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"seed": -1}, "seed"),
        ({"loss": 1.0}, "loss"),
        ({"style": "wild"}, "style"),
        ({"noise_m": 0.0}, "noise_m"),
        ({"rate_hz": -1.0}, "rate_hz"),
    ],
)
def test_arguments_out_of_range_are_named(arguments, named):
    with pytest.raises(ValueError, match=named):
        random_mission(**{"seed": 0, **arguments})
