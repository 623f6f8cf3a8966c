import numpy as np
import pytest

from hil_tests.paper_vehicles import HOV, PORTABLE, SAUCER, Circumstances, measure, simulate


def circumstances(n=200, *, inflow=0.0, supply=1.0, load=1.0, blocked=False):
    return Circumstances(
        inflow=np.full(n, inflow), supply=np.full(n, supply), load=np.full(n, load), blocked=np.full(n, blocked)
    )


def final_rpm(plant, part=1.0, **around):
    command = np.full(1000, part * plant.command_max)
    return simulate(plant, command, circumstances(1000, **around), np.random.default_rng(0))[-50:].mean()


@pytest.mark.parametrize(("plant", "speed_rpm"), [(HOV, 700.0), (SAUCER, 1200.0), (PORTABLE, 500.0)])
def test_top_speed_of_tables_1_to_3_in_still_water(plant, speed_rpm):
    assert plant.steady_speed(1.0, 0.0, 1.0) * plant.speed_max_rpm == pytest.approx(speed_rpm)
    assert plant.steady_speed(0.5 * plant.friction_share, 0.0, 1.0) == 0.0


@pytest.mark.parametrize("plant", [HOV, SAUCER, PORTABLE])
def test_the_signs_of_every_effect(plant):
    free = final_rpm(plant, 0.7)
    assert final_rpm(plant, 0.7, load=2.0) < 0.98 * free  # weeds
    assert final_rpm(plant, 0.7, inflow=0.2) > 1.005 * free  # water that already moves aft
    assert final_rpm(plant, 0.7, supply=0.9) < 0.93 * free  # battery
    assert final_rpm(plant, 0.7, blocked=True) == 0.0
    assert final_rpm(plant, -0.7) == pytest.approx(-free, rel=1e-3)


def test_delay_then_lag():
    command = np.where(np.arange(200) < 100, 2.0, 4.0)
    speed = simulate(HOV, command, circumstances(), np.random.default_rng(0))
    before, after = speed[95:100].mean(), speed[150:].mean()
    np.testing.assert_allclose(speed[100 : 100 + HOV.delay], before, rtol=0.02)
    third = speed[100 + HOV.delay + 2]  # three samples of 0.1 s are one lag of 0.3 s
    assert (third - before) / (after - before) == pytest.approx(1 - np.exp(-1), abs=0.05)


def test_hall_sensor_reports_whole_steps_and_loses_the_slowest_speeds():
    true_rpm = np.linspace(-500.0, 500.0, 400)
    measured = measure(PORTABLE, true_rpm, np.random.default_rng(1))
    np.testing.assert_array_equal(measured, np.round(measured))
    np.testing.assert_allclose(measured[np.abs(true_rpm) > 60], true_rpm[np.abs(true_rpm) > 60], rtol=0.006, atol=0.6)
    one_edge_rpm = 60.0 / PORTABLE.edges_per_turn / 0.1  # less than an edge in a period
    assert not measured[np.abs(true_rpm) < 0.9 * one_edge_rpm].any()
