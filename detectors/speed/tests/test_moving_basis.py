import pickle

import numpy as np
import pytest

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.moving_basis import NODES_MAX, SPACING_MIN_M, MovingBasisFlow
from detectors.speed.tests.drives import drive, run, zig_zag

RATE = 0.3  # share by which a flow is corrected at each visit of `teach`


def teach(flow, position, velocity, time_s=0.0, times=100):
    """Lets it learn this velocity at this place, as the law would."""
    flow.move(position, time_s)
    for _ in range(times):
        values = flow.values(position, time_s)
        flow.learn(values, RATE * (velocity - flow.velocity_mps(time_s, position)) / (values @ values))


def along(length_m, speed_mps=1.0, interval_s=1.0):
    """Times and positions of a straight way to the north-east."""
    times = np.arange(0.0, length_m / speed_mps, interval_s)
    return [(t, speed_mps * t * np.array([np.cos(0.7), np.sin(0.7)])) for t in times]


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.3, -0.9), (12345.6, -98765.4), (1e12, -1e12)])
def test_the_functions_add_up_to_one_everywhere(place):
    flow = MovingBasisFlow()
    position = np.array(place)
    flow.move(position, 0.0)
    values = flow.values(position, 0.0)
    assert values.sum() == pytest.approx(1.0)
    assert (values >= 0.0).all()


def test_uniform_flow_is_represented_exactly_wherever_it_is_looked_at():
    flow = MovingBasisFlow()
    truth = np.array([0.4, -0.3])
    for t, position in along(200.0):
        teach(flow, position, truth, t, times=30)
    for place in ([0.0, 0.0], [50.0, 40.0], [1e4, -1e4]):
        np.testing.assert_allclose(flow.velocity_mps(0.0, np.array(place)), truth, atol=1e-3)


def test_the_flow_does_not_jump_where_nodes_come_into_use():
    flow, rng = MovingBasisFlow(), np.random.default_rng(0)
    teach(flow, np.zeros(2), np.array([0.5, 0.2]))
    for t, position in along(30.0, interval_s=0.01):
        flow.move(position, t)
        before = flow.velocity_mps(t, position)
        if rng.random() < 0.02:
            teach(flow, position, rng.normal(size=2), t, times=1)
        else:
            after = flow.velocity_mps(t, position + 0.01 * np.array([1.0, 1.0]))
            assert np.linalg.norm(after - before) < 0.05


def test_flow_that_differs_from_place_to_place_is_kept_for_the_way_back():
    flow = MovingBasisFlow()

    def truth(position):
        return np.array([0.5 * np.sin(position[0] / 40.0), 0.2])

    way = [(t, np.array([t, 0.0])) for t in np.arange(0.0, 100.0)]
    for t, position in way + [(200.0 - t, position) for t, position in reversed(way)]:
        teach(flow, position, truth(position), t, times=3)
    kept = [np.linalg.norm(flow.velocity_mps(0.0, position) - truth(position)) for _, position in way]
    as_at_the_end = [np.linalg.norm(truth(way[0][1]) - truth(position)) for _, position in way]
    assert np.mean(kept) < 0.5 * np.mean(as_at_the_end)


def test_spacing_follows_the_area_driven_and_rarely_changes():
    flow = MovingBasisFlow()
    seen = []
    for t, position in along(1000.0):
        flow.move(position, t)
        seen.append(flow.spacing_m)
    changes = np.count_nonzero(np.diff(seen))
    assert seen[0] == SPACING_MIN_M
    assert 75.0 <= seen[-1] <= 256.0  # of a way of 150 to 300 m in the recent time
    assert changes <= 8
    for number in range(2000):  # then round and round a small place
        angle = number / 5.0
        flow.move(position + 4.0 * np.array([np.cos(angle), np.sin(angle)]), 1000.0 + number)
    assert flow.spacing_m <= 16.0


def test_widening_keeps_the_flow():
    flow = MovingBasisFlow()
    truth = np.array([0.7, -0.2])
    for t, position in along(40.0):
        teach(flow, position, truth, t)
    before = flow.spacing_m
    far = position + np.array([300.0, 0.0])
    flow.move(far, t + 1.0)
    assert flow.spacing_m > before
    np.testing.assert_allclose(flow.velocity_mps(0.0, position), truth, atol=0.01)
    np.testing.assert_allclose(flow.velocity_mps(0.0, far), truth, atol=0.01)


def test_memory_is_bounded():
    flow, rng = MovingBasisFlow(), np.random.default_rng(1)
    for number in range(3000):
        flow.move(rng.uniform(-50.0, 50.0, 2) * (1 + number % 7), float(number))
        assert flow.known_nodes <= NODES_MAX
    assert len(pickle.dumps(flow)) < 200_000


def test_three_components_over_the_horizontal_place():
    flow = MovingBasisFlow(dimensions=3)
    truth = np.array([0.1, 0.2, -0.05])
    teach(flow, np.array([5.0, 5.0, 30.0]), truth)
    np.testing.assert_allclose(flow.velocity_mps(0.0, np.array([5.0, 5.0, 90.0])), truth, atol=1e-6)


def test_a_frozen_copy_stays_as_it_is():
    flow = MovingBasisFlow()
    teach(flow, np.zeros(2), np.array([0.5, 0.0]))
    frozen = flow.frozen()
    place = np.array([0.2, 0.1])
    before = frozen.velocity_mps(0.0, place)
    teach(flow, np.zeros(2), np.array([-0.5, 1.0]))
    flow.move(np.array([500.0, 0.0]), 1.0)
    np.testing.assert_array_equal(frozen.velocity_mps(0.0, place), before)


def test_no_place_is_too_far():
    flow = MovingBasisFlow()
    for number, scale in enumerate((1.0, 1e6, 1e15, 1e-9, 1e15)):
        position = np.array([scale, -scale])
        teach(flow, position, np.array([0.1, 0.1]), 1e3 * number, times=2)
        assert np.isfinite(flow.velocity_mps(0.0, position)).all()


@pytest.mark.parametrize("origin", [(0.0, 0.0), (4.1e5, 5.6e6)])  # a local frame, and UTM
def test_the_law_learns_uniform_flow_and_speed_with_it(origin):
    times = np.arange(0.0, 300.0, 0.5)
    first, steps = drive(times, flow=(0.4, -0.3), speed=1.0, heading=zig_zag(), start=origin)
    estimate = run(AdaptiveEstimator(MovingBasisFlow()), first, steps)[-1]
    assert estimate.speed_mps == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(estimate.flow_mps, [0.4, -0.3], atol=0.02)


def test_pickled_it_goes_on_bit_for_bit():
    first, steps = drive(np.arange(0.0, 120.0, 1.0), flow=(0.4, -0.3), speed=1.0, heading=zig_zag())
    one = AdaptiveEstimator(MovingBasisFlow())
    one.begin(first, 0.0)
    for step in steps[:60]:
        one.update(step)
    other = pickle.loads(pickle.dumps(one))  # noqa: S301
    for step in steps[60:]:
        a, b = one.update(step), other.update(step)
        assert a.speed_mps == b.speed_mps
        np.testing.assert_array_equal(a.flow_mps, b.flow_mps)
