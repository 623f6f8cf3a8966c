"""The random runs are what they claim to be; the detector does on a few of them what it must on all."""

from __future__ import annotations

import numpy as np
import pytest

from detectors.thruster import ThrusterDetector
from detectors.verdict import Level
from hil_tests.random_runs import (
    COMMAND_MIN,
    DRIFT_MAX,
    DRIFT_SPAN_MIN,
    ONSET_MAX,
    ONSET_MIN,
    _drift,
    _linear,
    _noise,
    _ramped,
    _sine,
    _wandering,
    random_run,
)

# Not those of the benchmark, so that nobody tunes the detector on both.
HEALTHY_SEEDS = range(30_000, 30_012)
FAULTY_SEEDS = range(31_000, 31_012)


@pytest.mark.parametrize("style", ["plain", "varied"])
def test_a_run_is_its_seed_and_the_loss_begins_at_the_onset(style):
    for seed in range(10):
        healthy, again, faulty = (random_run(seed, loss, style) for loss in (0.0, 0.0, 0.07))
        before = slice(healthy.onset)
        np.testing.assert_array_equal(healthy.speed_rpm, again.speed_rpm)
        np.testing.assert_array_equal(healthy.command, faulty.command)
        np.testing.assert_array_equal(healthy.speed_rpm[before], faulty.speed_rpm[before])
        assert ONSET_MIN <= healthy.onset < ONSET_MAX
        settled = slice(healthy.onset + 60, None)
        ratio = np.median(faulty.speed_rpm[settled] / healthy.speed_rpm[settled])
        assert ratio == pytest.approx(0.93, abs=0.005), seed


@pytest.mark.parametrize("style", ["plain", "varied"])
def test_commands_stay_within_their_range_and_use_it(style):
    for seed in range(10):
        run = random_run(seed, style=style)
        assert len(run.time_s) == len(run.command) == len(run.speed_rpm) == 3000
        assert np.all(np.diff(run.time_s) > 0.0)
        assert run.command.min() >= COMMAND_MIN * 0.999
        assert np.ptp(run.command) > 0.4 * run.command.max()
        assert np.isfinite(run.speed_rpm).all()


def test_noise_is_of_unit_size_and_correlated_only_where_asked_for():
    correlations = {0.0: [], 1.0: []}
    for share, found in correlations.items():
        for seed in range(10):
            noise = _noise(np.random.default_rng(seed), 3000, share)
            assert noise.std() == pytest.approx(1.0, abs=0.2)
            found.append(np.corrcoef(noise[1:], noise[:-1])[0, 1])
    assert max(np.abs(correlations[0.0])) < 0.1
    assert min(correlations[1.0]) > 0.2


@pytest.mark.parametrize("kind", [_linear, _sine, _ramped, _wandering])
def test_no_drift_is_faster_than_allowed(kind):
    for seed in range(20):
        gain = _drift(np.random.default_rng(seed), 3000, (kind,))
        within_span = np.lib.stride_tricks.sliding_window_view(gain, DRIFT_SPAN_MIN)
        assert np.ptp(within_span, axis=1).max() <= DRIFT_MAX * 1.001


@pytest.mark.parametrize(
    ("arguments", "named"), [({"loss": 1.0}, "loss"), ({"style": "wild"}, "style"), ({"samples": 2700}, "samples")]
)
def test_arguments_out_of_range_are_named(arguments, named):
    with pytest.raises(ValueError, match=named):
        random_run(0, **arguments)


def faults(run):
    """Samples of FAULT, by the detector with its defaults."""
    return np.flatnonzero(ThrusterDetector().run(run.time_s, run.command, run.speed_rpm).level == Level.FAULT)


def test_no_fault_is_found_in_healthy_runs():
    cried_wolf = [seed for seed in HEALTHY_SEEDS if len(faults(random_run(seed)))]
    print(f"healthy seeds {HEALTHY_SEEDS}, with a FAULT: {cried_wolf}")
    assert not cried_wolf


def test_a_lasting_loss_of_seven_percent_is_found_within_twenty_samples():
    delays = {}
    for seed in FAULTY_SEEDS:
        run = random_run(seed, loss=0.07)
        delays[seed] = next(iter(faults(run)), np.inf) - run.onset
    print(f"samples to the first FAULT, by seed: {delays}")
    assert min(delays.values()) >= 0
    assert sum(delay <= 20 for delay in delays.values()) >= 10
