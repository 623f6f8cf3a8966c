"""How far a dive should be: told the real time."""

from math import inf, nan

import pytest

from gateway.watch.pace import FASTEST, SLOWEST, Pace
from gateway.watch.source import REST_S, Rhythm


def begun(speed: float = 1.0) -> Pace:
    pace = Pace(speed)
    pace.at(0.0, 100.0)
    return pace


def test_it_goes_on_with_the_real_time_from_where_it_is():
    pace = begun(2.0)
    assert Pace(4.0).wanted_s(1e9) == 0.0  # the first look is at the beginning
    assert pace.wanted_s(101.5) == 3.0
    pace.at(3.0, 101.5)
    pace.faster()
    assert pace.wanted_s(102.0) == 5.0
    pace.slower()
    pace.slower()
    assert pace.wanted_s(102.0) == 3.5


def test_paused_it_stays_and_goes_on_from_there():
    pace = begun()
    pace.toggle()
    assert pace.wanted_s(130.0) == 0.0
    pace.at(0.0, 130.0)
    pace.toggle()
    assert pace.wanted_s(131.0) == 1.0


def test_a_machine_that_is_too_slow_is_not_hurried_and_is_told():
    pace = begun(16.0)
    for second in range(1, 9):
        assert pace.wanted_s(100.0 + second) == pytest.approx(pace.dive_s + 16.0)
        pace.at(4.0 * second, 100.0 + second)
    assert pace.reached == pytest.approx(4.0, abs=0.5)


def test_skips_add_up_also_while_paused():
    pace = begun()
    pace.stay()
    pace.skip(30.0)
    pace.skip(30.0)
    assert pace.wanted_s(100.0) == 60.0 and pace.skipping
    pace.at(60.0, 101.0)
    assert not pace.skipping and pace.wanted_s(105.0) == 60.0


def test_on_its_way_a_pause_stops_it():
    pace = begun()
    pace.skip(inf)
    assert pace.wanted_s(100.1) == inf
    pace.at(7.0, 100.2)
    pace.toggle()
    assert pace.paused and pace.wanted_s(200.0) == 7.0


def test_from_the_beginning_again_at_the_same_speed():
    pace = begun(8.0)
    pace.at(50.0, 110.0)
    pace.stay()
    pace.restart()
    assert (pace.dive_s, pace.paused, pace.speed, pace.wanted_s(500.0)) == (0.0, False, 8.0, 0.0)


def test_speed_stays_within_its_bounds():
    fast, slow = Pace(FASTEST), Pace(SLOWEST)
    fast.faster()
    slow.slower()
    assert (fast.speed, slow.speed) == (FASTEST, SLOWEST)


@pytest.mark.parametrize("speed", [0.0, -1.0, nan, inf, 1000.0])
def test_a_speed_that_is_none_is_refused(speed):
    with pytest.raises(ValueError, match=r"want 0\.125 to 256 times"):
        Pace(speed)


def test_a_late_look_does_not_make_the_next_ones_early():
    now_s = [0.0]
    rhythm = Rhythm(0.5, lambda: now_s[0])
    now_s[0] = 0.1
    assert rhythm.rest_s() == pytest.approx(0.4)
    now_s[0] = 2.5
    assert rhythm.rest_s() == pytest.approx(REST_S)
    now_s[0] += REST_S
    assert rhythm.rest_s() == pytest.approx(0.5)
