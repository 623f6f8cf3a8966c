import pytest

from detectors.speed.sideways import LASTS_S, Sideways


def driven(ahead, aside, *, seconds=20.0, interval_s=0.1, sideways=None):
    sideways = sideways or Sideways()
    for _ in range(round(seconds / interval_s)):
        sideways.take(ahead, aside, interval_s)
    return sideways


@pytest.mark.parametrize(
    ("ahead", "aside", "hard"),
    [
        (0.5, 0.0, False),
        (0.5, 0.2, False),  # a sixth of the thrust
        (0.5, 0.3, True),
        (0.5, -0.3, True),
        (-0.5, 0.3, True),
        (0.0, 0.1, False),  # keeps its station
        (0.0, 0.3, True),
        (None, 0.3, True),
        (None, 0.0, False),
    ],
)
def test_it_takes_a_good_share_of_the_thrust(ahead, aside, hard):
    assert driven(ahead, aside).hard is hard


def test_thrust_to_and_fro_is_thrust_as_well():
    sideways = Sideways()
    for number in range(200):
        sideways.take(0.5, 0.5 if number // 10 % 2 else -0.5, 0.1)
    assert sideways.hard


def test_the_hull_goes_on_for_a_while():
    pushed = driven(0.5, 0.5)
    assert driven(0.5, 0.0, seconds=0.5 * LASTS_S, sideways=pushed).hard
    assert not driven(0.5, 0.0, seconds=2.0 * LASTS_S, sideways=pushed).hard


def test_no_time_has_passed_with_the_first_sample():
    sideways = Sideways()
    sideways.take(0.0, 1.0, 0.0)
    assert not sideways.hard


def test_intervals_of_any_length_come_to_the_same():
    fine, coarse = driven(0.4, 0.3, seconds=2.0, interval_s=0.02), driven(0.4, 0.3, seconds=2.0, interval_s=1.0)
    assert (fine._ahead, fine._aside) == pytest.approx((coarse._ahead, coarse._aside))
