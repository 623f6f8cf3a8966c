from collections import Counter

import pytest

from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample
from detectors.navigation.waiting import HEADING_S, WAITING_MAX, WaitingMeasurements


def dvl(time_s):
    return DvlSample(time_s, (1.0, 0.0, 0.0))


def no_delay(kind):
    return 0.0


def all_due(waiting, until_s, delay_s=no_delay):
    found = []
    while (one := waiting.due(until_s, delay_s)) is not None:
        found.append(one)
    return found


def waiting_with(*measurements):
    waiting = WaitingMeasurements()
    for one in measurements:
        waiting.add(one)
    return waiting


def test_measurements_come_by_their_instants_whatever_their_kind():
    samples = [dvl(1.0), FixSample(2.0, 0.5, 0.5), DepthSample(3.0, 20.0), dvl(4.0)]
    waiting = waiting_with(*samples[::3], samples[2], samples[1])
    assert all_due(waiting, 3.5) == samples[:3]
    assert all_due(waiting, 4.5) == samples[3:]


def test_what_was_stamped_late_comes_before_what_was_not():
    late, other = dvl(2.0), DepthSample(1.5, 20.0)
    waiting = waiting_with(other, late)
    assert all_due(waiting, 3.0, lambda kind: 1.0 if kind is DvlSample else 0.0) == [late, other]


def test_due_is_only_what_is_before():
    waiting = waiting_with(dvl(2.0))
    assert waiting.due(2.0, no_delay) is None
    assert waiting.due(2.001, no_delay) == dvl(2.0)


def test_the_oldest_of_too_many_are_dropped_and_counted():
    waiting = waiting_with(*(dvl(float(number)) for number in range(WAITING_MAX + 2)), DepthSample(0.0, 20.0))
    assert waiting.refused == Counter({"measurement while the IMU was silent": 2})
    assert [one.time_s for one in all_due(waiting, 3.5)] == [0.0, 2.0, 3.0]


@pytest.mark.parametrize(("after_s", "kept"), [(0.99 * HEADING_S, 1), (HEADING_S, 2)])
def test_headings_are_kept_once_a_second(after_s, kept):
    waiting = waiting_with(*(AttitudeSample(time_s, (0.0, 0.0, 1.0)) for time_s in (0.0, after_s)))
    assert len(all_due(waiting, 9.0)) == kept
    assert not waiting.refused


def test_cleared_nothing_waits():
    waiting = waiting_with(dvl(1.0), DepthSample(1.0, 20.0))
    waiting.clear()
    assert all_due(waiting, 9.0) == []
