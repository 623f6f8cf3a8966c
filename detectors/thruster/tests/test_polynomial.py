import numpy as np
import pytest

from detectors.thruster.polynomial import CommandRange, fit, mape, noise, speed_floor_rpm


def points(n: int = 120, seed: int = 0):
    rng = np.random.default_rng(seed)
    command = rng.uniform(-5.0, 5.0, n)
    return command, 140.0 * command - 3.0 * command**3 / 10 + rng.normal(0.0, 3.0, n)


@pytest.mark.parametrize("order", range(1, 7))
@pytest.mark.parametrize("offset", [0.0, 1500.0])  # volts, PWM microseconds
def test_predicts_as_numpy_polyfit(order, offset):
    command, speed = points()
    curve = fit(command + offset, speed, order)
    at = np.linspace(-5.0, 5.0, 50)
    # polyfit itself is asked in centred commands, where it is well conditioned
    np.testing.assert_allclose(
        curve.predict(at + offset), np.polyval(np.polyfit(command, speed, order), at), rtol=1e-7
    )
    assert (curve.order, curve.window) == (order, 120)


def test_scaling_changes_nothing():
    command, speed = points()
    a, b = fit(command, speed, 3), fit(command, speed, 3, within=CommandRange(2.0, 20.0))
    np.testing.assert_allclose(b.predict(command), a.predict(command), rtol=1e-9)
    assert b.leverage(4.0) == pytest.approx(a.leverage(4.0))


def test_leverage_is_the_diagonal_of_the_hat_matrix():
    command, speed = points(40)
    x = np.vander(command, 4)
    hat = np.diag(x @ np.linalg.inv(x.T @ x) @ x.T)
    curve = fit(command, speed, 3)
    np.testing.assert_allclose([curve.leverage(float(u)) for u in command], hat, rtol=1e-6)
    assert curve.leverage(15.0) > 10.0  # extrapolation


@pytest.mark.parametrize("levels", [2, 3, 4])
def test_order_is_bounded_by_the_distinct_commands(levels):
    command = np.tile(np.linspace(1.0, 4.0, levels), 30)
    curve = fit(command, 100.0 * command, 5)
    assert curve.order == levels - 1
    np.testing.assert_allclose(curve.predict(command), 100.0 * command, rtol=1e-9)


def test_a_constant_command_gives_a_constant_that_knows_where_it_holds():
    speed = 500.0 + np.arange(20.0)
    curve = fit(np.full(20, 3.0), speed, 4)
    assert curve.order == 0
    assert curve.predict(3.0) == pytest.approx(speed.mean())
    assert curve.leverage(3.0) == pytest.approx(1 / 20)
    assert curve.leverage(3.5) == np.inf


def test_noise_is_the_standard_deviation_and_bears_outliers():
    residual = np.random.default_rng(3).normal(0.0, 4.0, 5000)
    assert noise(residual) == pytest.approx(4.0, rel=0.05)
    residual[:250] = 1000.0
    assert noise(residual) < 6.0


def test_mape_is_relative_with_a_floor_at_standstill():
    measured = np.array([1000.0, -500.0, 0.0])
    predicted = np.array([990.0, -510.0, 5.0])
    floor = speed_floor_rpm(measured)
    assert floor == 50.0
    assert mape(measured, predicted, floor) == pytest.approx((0.01 + 0.02 + 0.1) / 3)
    assert speed_floor_rpm(np.zeros(3)) == 1.0


@pytest.mark.parametrize(
    ("command", "speed", "order", "names"),
    [
        (np.zeros(4), np.zeros(5), 1, "one length"),
        (np.zeros(0), np.zeros(0), 1, "one length"),
        (np.zeros(4), np.zeros(4), -1, "order = -1"),
    ],
)
def test_refuses(command, speed, order, names):
    with pytest.raises(ValueError, match=names):
        fit(command, speed, order)
