"""What the thrusters do together, from what each of them is told."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.thrust import Shares, ThrustDemand

# ArduSub's frame "vectored 6DOF": four at 45 degrees, four vertical
VECTORED = {
    1: Shares(-0.7, 0.7),
    2: Shares(-0.7, -0.7),
    3: Shares(0.7, 0.7),
    4: Shares(0.7, -0.7),
    **{number: Shares() for number in (5, 6, 7, 8)},
}
fractions = st.floats(-1.0, 1.0)


def demanded(commands: dict[int, float], shares: dict[int, Shares] = VECTORED) -> tuple[float | None, float]:
    demand = ThrustDemand(shares, stale_s=0.5)
    for number in demand.thrusters & commands.keys():
        demand.command(0.0, number, commands[number])
    return demand.over(0.2, 0.4)


@given(fractions)
def test_pure_surge_and_pure_sway_come_back(command):
    ahead = {1: -command, 2: -command, 3: command, 4: command}
    assert demanded(ahead) == (pytest.approx(command), pytest.approx(0.0, abs=1e-6))
    right = {1: command, 2: -command, 3: command, 4: -command}
    assert demanded(right) == (pytest.approx(0.0, abs=1e-6), pytest.approx(command))


def test_yaw_and_depth_drive_nowhere():
    assert demanded({1: 0.5, 2: -0.5, 3: -0.5, 4: 0.5, 5: 1.0}) == (0.0, 0.0)


def test_thrust_goes_with_the_square():
    two = {1: Shares(ahead=1.0), 2: Shares(ahead=1.0)}
    assert demanded({1: 1.0, 2: 0.0}, two)[0] == pytest.approx(math.sqrt(0.5))
    assert demanded({1: 0.6, 2: -0.8}, two)[0] == pytest.approx(-math.sqrt(0.14))


def test_it_is_the_mean_over_the_time():
    demand = ThrustDemand({1: Shares(ahead=1.0)}, stale_s=0.5)
    for time_s, fraction in ((0.0, 0.0), (0.3, 1.0), (0.5, 1.0)):
        demand.command(time_s, 1, fraction)
    assert demand.over(0.2, 0.4)[0] == pytest.approx(math.sqrt(0.5))
    assert demand.over(0.3, 0.4) == (1.0, 0.0)


@pytest.mark.parametrize("commands", [{}, {1: 0.5, 2: 0.5, 3: 0.5}])
def test_not_known_where_one_of_them_is_not(commands):
    assert demanded(commands) == (None, 0.0)


def test_stale_command_is_not_known():
    demand = ThrustDemand({1: Shares(ahead=1.0)}, stale_s=0.5)
    demand.command(0.0, 1, 0.5)
    assert demand.over(0.3, 0.5) == (0.5, 0.0)
    assert demand.over(0.4, 0.6) == (None, 0.0)
    demand.command(1.0, 1, 0.5)
    assert demand.over(0.9, 1.1) == (None, 0.0)  # what it was told in between is not known
    assert demand.over(1.0, 1.1) == (0.5, 0.0)


def test_without_shares_there_is_nothing_to_know():
    demand = ThrustDemand({1: Shares(), 2: Shares(right=-1.0)}, stale_s=0.5)
    assert demand.thrusters == {2}
    demand.command(0.0, 2, 0.5)
    assert demand.over(0.1, 0.2) == (None, -0.5)


@pytest.mark.parametrize("wrong", [{"ahead": 1.1}, {"right": -7.0}, {"ahead": math.nan}])
def test_shares_are_checked(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Shares(**wrong)
