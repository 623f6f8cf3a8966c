"""What is missing in how a thruster was driven is said, with the manoeuvre that mends it."""

import numpy as np
import pytest

from gateway.commissioning.dive import ThrusterSamples
from gateway.commissioning.excitation import excitation
from gateway.commissioning.tests.made_thrusters import samples

RATE_HZ = 20.0


def driven(command):
    command = np.asarray(command, dtype=float)
    blank = np.full(len(command), np.nan)
    return ThrusterSamples(RATE_HZ, np.arange(len(command)) / RATE_HZ, command, 3000.0 * command, blank, blank)


def swing(size, seconds=90.0, offset=0.0):
    return offset + size * np.sin(np.arange(int(seconds * RATE_HZ)) * 0.2)


def missing(*commands):
    return list(excitation([driven(one) for one in commands]).missing())


def test_nothing_is_missing_where_it_was_driven_both_ways():
    assert missing(swing(0.8)) == []


def test_nothing_is_missing_of_a_direction_that_it_is_never_driven_in():
    ahead = swing(0.4, offset=0.4)
    found = excitation([driven(ahead)])
    assert list(found.missing()) == []
    assert (found.astern, round(found.ahead, 2)) == (0.0, 0.8)


@pytest.mark.parametrize("size", [0.1, 0.2, 0.35])
def test_a_weak_direction_is_named(size):
    (line,) = missing(np.concatenate([np.maximum(swing(0.8), 0.0), np.minimum(swing(size), 0.0)]))
    assert line == f"astern was never commanded beyond -{size:.0%}: drive back and forth for 30 s, up to -60%"


def test_too_short_is_named():
    (line,) = missing(swing(0.8, 40.0))
    assert line.startswith("it was driven for 38 s, 60 s are wanted: drive back and forth for 30 s more")


def test_two_short_dives_are_long_enough():
    assert missing(swing(0.8, 40.0), swing(0.8, 40.0)) == []


def test_commands_that_only_creep_do_not_show_a_delay():
    (line,) = missing(0.8 * np.sin(np.arange(4000) * 0.002))
    assert line.startswith("its command changed quickly 0 times, 12 are wanted")


def test_a_hole_between_two_commands_is_named():
    steps = np.where(np.arange(3000) // 60 % 2, 0.15, 0.75)
    (line,) = missing(steps)
    assert line == "nothing was commanded between +15% and +75%: drive at +45% for 10 s"


def test_a_thruster_at_rest_was_not_driven():
    found = excitation([driven(np.zeros(400))])
    assert (found.driven_s, found.ahead, found.astern, found.steps) == (0.0, 0.0, 0.0, 0)


def test_a_jump_over_a_gap_in_time_is_no_step():
    whole = driven(np.where(np.arange(40) < 20, 0.0, 0.8))
    torn = ThrusterSamples(RATE_HZ, whole.time_s + np.where(np.arange(40) < 20, 0.0, 9.0), *whole.columns()[1:])
    assert (excitation([whole]).steps, excitation([torn]).steps) == (1, 0)


def test_made_up_thrusters_lack_nothing():
    assert list(excitation([samples(90.0)]).missing()) == []
