"""What a dive brings: spikes, gaps, jitter, commands never seen before, weeds that come and go."""

from dataclasses import replace

import numpy as np
import pytest

from detectors.thruster import FaultKind, ThrusterConfig, ThrusterDetector
from detectors.thruster.tests.simulation import RATE_HZ, Thruster, cruising, lasting
from detectors.verdict import Level

SEEDS = (10, 11)
HELD_SEEDS = (38, 45)


def healthy(count, seed):
    return Thruster().simulate(cruising(count, seed), seed=seed)


def levels(series, config=None):
    return ThrusterDetector(config).run(*series.arguments).level


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("reading_rpm", [65535.0, 0.0, -3000.0])
@pytest.mark.parametrize("spikes", [4, 60])
def test_single_wild_readings_are_never_a_finding(reading_rpm, spikes, seed):
    count = 1300
    rng = np.random.default_rng(seed)
    at = rng.choice(np.arange(0, count, 6), spikes, replace=False).tolist()
    spiked = healthy(count, seed).spoiled(at, speed_rpm=reading_rpm)
    assert set(levels(spiked).tolist()) == {Level.UNKNOWN, Level.NORMAL}


@pytest.mark.parametrize("seed", SEEDS)
def test_gaps_in_time_are_no_finding(seed):
    kept = np.ones(2000, dtype=bool)
    for start, length in ((250, 60), (800, 100), (1100, 3), (1300, 5), (1310, 400)):
        kept[start : start + length] = False
    assert set(levels(healthy(2000, seed)[kept]).tolist()) == {Level.UNKNOWN, Level.NORMAL}


@pytest.mark.parametrize("seed", SEEDS)
def test_samples_lost_here_and_there_are_no_finding(seed):
    kept = np.random.default_rng(seed).random(2000) > 0.02
    assert set(levels(healthy(2000, seed)[kept]).tolist()) == {Level.UNKNOWN, Level.NORMAL}


def test_uneven_sampling_is_no_finding_and_hides_no_fault():
    count = 1500
    series = Thruster().simulate(cruising(count, 3), gain=lasting(count, 1200, 0.85), seed=3)
    uneven = replace(series, time_s=series.time_s + np.random.default_rng(0).uniform(0.0, 0.015, count))
    said = levels(uneven)
    assert set(said[:1200].tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert Level.FAULT in said[1200:1225]


@pytest.mark.parametrize("command", [0.95, 0.1])
def test_a_command_outside_what_was_learnt_is_unknown_not_a_fault(command):
    commands = cruising(1500, 6, low=0.3, high=0.6)
    commands[1200:1240] = command
    # a curve that bends off outside of what was seen
    verdicts = ThrusterDetector().run(*Thruster(bend=0.5).simulate(commands, seed=6).arguments)
    assert set(verdicts.level[1203:1240].tolist()) == {Level.UNKNOWN}
    assert set(verdicts.reason[1203:1240]) == {"command not learnt yet"}
    assert Level.FAULT not in verdicts.level
    assert verdicts.level[-1] == Level.NORMAL


def held_both_ways(count, seed):
    """Commands of random size and direction, each held for 1 to 10 s: a window has few of them."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-0.8, 0.8, count), rng.integers(50, 500, count))[:count]


@pytest.mark.parametrize("seed", HELD_SEEDS)
def test_slow_levels_do_not_bend_the_curve_between_the_few_faster_ones(seed):
    thruster, count = Thruster(bend=0.8, dead_band=0.05, noise=0.001), 3000
    said = levels(thruster.simulate(held_both_ways(count, seed), seed=seed))
    assert set(said.tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert np.mean(said[1000:] == Level.NORMAL) > 0.5


@pytest.mark.parametrize("seed", SEEDS)
def test_weeds_come_go_and_come_again(seed):
    count, come, go, again = 2600, 1200, 1700, 2300  # 10 s of weeds
    gain = lasting(count, come, 0.85, go) * lasting(count, again, 0.85)
    verdicts = ThrusterDetector().run(*Thruster().simulate(cruising(count, seed), gain=gain, seed=seed).arguments)
    level = verdicts.level
    assert Level.FAULT not in level[:come]
    assert Level.FAULT in level[come : come + 25]
    assert set(level[come + 25 : go].tolist()) == {Level.FAULT}
    freed = go + int(5 * RATE_HZ)
    assert Level.NORMAL in level[go:freed]
    assert set(level[freed:again].tolist()) <= {Level.NORMAL, Level.UNKNOWN}
    assert Level.FAULT in level[again : again + 25]
    assert set(verdicts.kind[level == Level.FAULT]) == {FaultKind.ENTANGLED}


def test_a_long_fault_does_not_become_normal():
    count = 3500
    series = Thruster().simulate(cruising(count, 7), gain=lasting(count, 1200, 0.8), seed=7)
    assert set(levels(series)[1225:].tolist()) == {Level.FAULT}


def test_a_fixed_threshold_is_kept_in_rpm():
    count = 1600
    command = cruising(count, 9, low=0.4)
    faulty = Thruster().simulate(command, gain=lasting(count, 1300, 0.8), seed=9)
    found = ThrusterDetector(ThrusterConfig(threshold_rpm=200.0)).run(*faulty.arguments)
    known = np.isfinite(found.threshold_rpm)
    np.testing.assert_allclose(found.threshold_rpm[known][:100], 200.0)
    assert Level.FAULT not in found.level[:1300]
    assert Level.FAULT in found.level[1300:1330]
    generous = levels(faulty[:1400], ThrusterConfig(threshold_rpm=2500.0))
    assert set(generous.tolist()) <= {Level.UNKNOWN, Level.NORMAL}
