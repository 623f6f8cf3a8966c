import numpy as np
import pytest

from detectors.thruster.delay import align, correlations, estimate_delay


def series(delay: int, n: int = 300, seed: int = 0):
    rng = np.random.default_rng(seed)
    command = np.cumsum(rng.normal(size=n))
    speed = np.concatenate((np.full(delay, command[0]), command[: n - delay])) * 40.0 + rng.normal(size=n)
    return command, speed


def test_equals_numpy_corrcoef_at_every_delay():
    command, speed = series(4)
    expected = [np.corrcoef(command[:290], speed[tau : tau + 290])[0, 1] for tau in range(11)]
    np.testing.assert_allclose(correlations(command, speed, 10), expected, rtol=1e-12)


@pytest.mark.parametrize("delay", range(9))
def test_finds_the_delay(delay):
    assert estimate_delay(*series(delay, seed=delay), delay_max=10) == delay


def test_offset_and_gain_of_the_series_do_not_matter():
    command, speed = series(3)
    r = correlations(command, speed, 8)
    np.testing.assert_allclose(correlations(1500 + 400 * command, 1e6 + speed / 1e3, 8), r, atol=1e-9)


@pytest.mark.parametrize("constant", ["command", "speed"])
def test_nothing_changes_no_delay_known(constant):
    command, speed = series(3)
    if constant == "command":
        command = np.full_like(command, 0.1)
    else:
        speed = np.full_like(speed, 812.3)
    assert np.isnan(correlations(command, speed, 8)).all()
    assert estimate_delay(command, speed, 8) == 0
    assert estimate_delay(command, speed, 8, default=5) == 5


def test_speed_that_changes_at_some_delays_only():
    command = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    speed = np.array([7.0, 7.0, 7.0, 7.0, 8.0, 9.0])  # the pairs of delay 0 see a constant
    r = correlations(command, speed, 2)
    assert np.isnan(r[0])
    assert np.isfinite(r[1:]).all()
    assert estimate_delay(command, speed, 2) in (1, 2)


def test_align_puts_each_speed_beside_its_command():
    command, speed = np.arange(10.0), np.arange(10.0) - 3.0
    u, v = align(command, speed, 3)
    np.testing.assert_array_equal(v, u)
    assert len(align(command, speed, 0)[0]) == 10


@pytest.mark.parametrize(
    ("command", "speed", "delay_max", "names"),
    [
        (np.zeros(10), np.zeros(9), 2, r"\(10,\).*\(9,\)"),
        (np.zeros((5, 2)), np.zeros((5, 2)), 2, "one length"),
        (np.zeros(10), np.zeros(10), -1, "delay_max = -1"),
        (np.zeros(10), np.zeros(10), 9, "10 samples"),
    ],
)
def test_refuses(command, speed, delay_max, names):
    with pytest.raises(ValueError, match=names):
        correlations(command, speed, delay_max)
