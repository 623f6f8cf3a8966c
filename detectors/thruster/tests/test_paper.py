import pickle

import numpy as np
import pytest

from detectors.thruster.paper import FixedPolynomial, OnlinePolynomial
from detectors.thruster.sample import ThrusterSample
from detectors.verdict import Level

DELAY = 3
FIRST, SECOND = 600, 720


def samples(n=900, *, faults=((FIRST, 0.95), (SECOND, 0.93)), noise_rpm=1.0, drift=0.0, seed=1):
    """A static thruster with delay: each fault multiplies the speed from its sample on."""
    rng = np.random.default_rng(seed)
    i = np.arange(n)
    command = 3.0 + 1.2 * np.sin(i / 4.0) + 0.7 * np.sin(i / 31.0 + seed)
    speed = 240.0 * command - 8.0 * command**2
    speed = np.concatenate((np.full(DELAY, speed[0]), speed[:-DELAY])) * (1.0 + drift * np.arange(n) / n)
    for start, gain in faults:
        speed[start:] *= gain
    speed += rng.normal(0.0, noise_rpm, n)
    return [ThrusterSample(0.1 * i, float(u), float(v)) for i, (u, v) in enumerate(zip(command, speed, strict=True))]


def rule(kind=OnlinePolynomial, **arguments):
    defaults = {"window_max": 200, "warmup": 300, "search": "exact", "threshold_rpm": 8.0, "order_max": 3}
    return kind(**(defaults | arguments))


def faults(steps):
    return [i for i, step in enumerate(steps) if step.level is Level.FAULT]


@pytest.mark.parametrize("search", ["exact", "swarm"])
def test_two_faults_one_on_top_of_the_other(search):
    steps = [r.step(s) for r in [rule(search=search)] for s in samples()]
    found = faults(steps)
    # rule (3): suspected at the fault's first sample, sure at the next
    assert steps[FIRST].level is Level.SUSPECT
    assert found[0] == FIRST + 1
    assert steps[FIRST + 1].fault_since_s == pytest.approx(0.1 * FIRST)
    relearnt = max(i for i in found if i < SECOND) + 1
    assert 20 <= relearnt - FIRST <= 60  # about window_min
    assert all(step.level is Level.NORMAL for step in steps[relearnt:SECOND])
    assert steps[SECOND].level is Level.SUSPECT
    assert SECOND + 1 in found


def test_no_model_in_the_warmup_then_one():
    steps = [r.step(s) for r in [rule()] for s in samples(310)]
    assert all(step.level is Level.UNKNOWN and step.window == 0 and step.score == 0.0 for step in steps[:299])
    assert np.isnan(steps[298].residual_rpm)
    assert steps[299].refitted
    assert steps[299].level is Level.NORMAL
    assert steps[299].delay == DELAY
    assert 50 <= steps[299].window <= 200
    assert steps[305].predicted_rpm + steps[305].residual_rpm == pytest.approx(samples(310)[305].speed_rpm)


def test_drift_is_followed_online_and_misjudged_by_the_fixed_model():
    drifting = samples(faults=(), drift=0.1)
    online = [r.step(s) for r in [rule()] for s in drifting]
    fixed = [r.step(s) for r in [rule(FixedPolynomial)] for s in drifting]
    assert not faults(online)
    assert sum(step.refitted for step in online) > 1  # the forecast left the threshold, the new model was within
    assert faults(fixed)
    assert sum(step.refitted for step in fixed) == 1
    # the same first model
    assert online[299] == fixed[299]


def test_a_refit_keeps_the_forecast_that_led_to_it():
    steps = [r.step(s) for r in [rule()] for s in samples(faults=(), drift=0.1)]
    refits = [step for step in steps[300:] if step.refitted]
    assert all(abs(step.forecast_residual_rpm) > 8.0 >= abs(step.residual_rpm) for step in refits)
    assert all(step.forecast_residual_rpm == step.residual_rpm for step in steps[300:] if not step.refitted)


@pytest.mark.parametrize("search", ["exact", "swarm"])
def test_pickled_at_any_sample_it_goes_on_bit_for_bit(search):
    data = samples(680)
    whole = rule(search=search)
    expected = [whole.step(s) for s in data]
    for cut in (10, 299, FIRST, FIRST + 1, FIRST + 9):
        part = rule(search=search)
        for s in data[:cut]:
            part.step(s)
        resumed = pickle.loads(pickle.dumps(part))  # noqa: S301
        assert repr([resumed.step(s) for s in data[cut:]]) == repr(expected[cut:])


def test_automatic_threshold_finds_both_faults_without_a_false_alarm():
    steps = [r.step(s) for r in [rule(threshold_rpm=None)] for s in samples()]
    found = faults(steps)
    assert found[0] == FIRST + 1
    assert SECOND + 1 in found
    healthy = steps[300:FIRST]
    assert not faults(healthy)
    assert np.median([step.threshold_rpm for step in healthy]) == pytest.approx(5.0, rel=0.4)  # noise of 1 rpm


def test_automatic_threshold_scales_with_the_speed_and_with_the_noise():
    quiet = [r.step(s) for r in [rule(threshold_rpm=None)] for s in samples(500, faults=())]
    louder = [ThrusterSample(s.time_s, s.command, 8.0 * s.speed_rpm) for s in samples(500, faults=())]
    loud = [r.step(s) for r in [rule(threshold_rpm=None)] for s in louder]
    np.testing.assert_allclose([s.threshold_rpm for s in loud], [8.0 * s.threshold_rpm for s in quiet], rtol=1e-6)
    np.testing.assert_allclose([s.score for s in loud], [s.score for s in quiet], rtol=1e-6)


def test_automatic_threshold_is_no_finer_than_the_sensor():
    coarse = [ThrusterSample(s.time_s, s.command, 30.0 * round(s.speed_rpm / 30.0)) for s in samples(500, faults=())]
    steps = [r.step(s) for r in [rule(threshold_rpm=None)] for s in coarse]
    assert min(step.threshold_rpm for step in steps[299:]) >= 30.0


def test_commands_that_do_not_change_then_do():
    n = 500
    command = np.where(np.arange(n) < 400, 3.0, 4.0)
    noise = np.random.default_rng(0).normal(0.0, 1.0, n)
    data = [ThrusterSample(0.1 * i, float(command[i]), float(200.0 * command[i] + noise[i])) for i in range(n)]
    for threshold_rpm in (8.0, None):
        steps = [r.step(s) for r in [rule(threshold_rpm=threshold_rpm, delay_max=0)] for s in data]
        assert steps[350].order == 0
        assert not faults(steps)
        assert steps[400].refitted
        assert steps[-1].order >= 1


def test_standstill_is_no_fault():
    data = [ThrusterSample(0.1 * i, 0.0, 0.0) for i in range(400)]
    for threshold_rpm in (8.0, None):
        steps = [r.step(s) for r in [rule(threshold_rpm=threshold_rpm)] for s in data]
        assert {step.level for step in steps[299:]} == {Level.NORMAL}
        assert all(np.isfinite(step.score) for step in steps)


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ({"threshold_rpm": 0.0}, "threshold_rpm = 0.0"),
        ({"threshold_rpm": float("nan")}, "threshold_rpm = nan"),
        ({"warmup": 59}, "warmup = 59.*60"),
        ({"order_max": 50}, "order_max = 50"),
        ({"delay_max": -1}, "delay_max = -1"),
        ({"window_max": 40}, "window_max = 40"),
        ({"search": "luck"}, "search = 'luck'"),
    ],
)
def test_refuses(arguments, names):
    with pytest.raises(ValueError, match=names):
        rule(**arguments)
