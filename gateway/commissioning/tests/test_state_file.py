"""The first run starts from what was learnt: it judges from its first sample."""

import numpy as np
import pytest

from detectors.verdict import Level
from gateway import state
from gateway.commissioning.state_file import taught
from gateway.commissioning.successive import successive
from gateway.commissioning.tests.made_thrusters import config, dive, samples
from gateway.commissioning.thruster import commission_thruster
from gateway.memory import Memory
from gateway.moment import Moment
from gateway.pipeline import Pipeline


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    return config(tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="module")
def learnt(settings):
    return [commission_thruster(settings.thruster[0], settings, [dive({1: samples(240.0)})], False)]


def test_dives_follow_each_other_on_one_grid():
    one, two = samples(20.0), samples(20.0)
    (first, *_), (second, *_) = successive([one, two])
    np.testing.assert_array_equal(first, one.time_s)
    assert second[0] > first[-1]
    assert (second[0] - first[0]) * one.rate_hz == pytest.approx(round((second[0] - first[0]) * one.rate_hz))
    np.testing.assert_allclose(np.diff(second), np.diff(first), atol=1e-9)


def test_the_next_run_knows_thruster_rate_and_curve(settings, learnt, tmp_path):
    state.write(tmp_path / "vehicle.state", state.pack(taught(settings, learnt).state))
    pipeline = Pipeline(settings)
    Memory(tmp_path / "vehicle.state", 600.0, lambda: 5000.0).recall(pipeline)
    known = pipeline.learnt()
    assert known["thruster 1"].alignment == learnt[0].samples[0].rate_hz
    detector = known["thruster 1"].detector
    assert detector.commissioned is not None
    later = samples(30.0, seed=8, start_s=2.0)
    assert (detector.run(*later.columns()).level == Level.NORMAL).mean() > 0.6
    assert known["thruster 2"].detector.commissioned is None
    assert set(pipeline.levels().values()) <= {Level.UNKNOWN}


def test_of_several_dives_the_one_that_shows_most_is_known_best(settings):
    wide, narrow = dive({1: samples(120.0)}, "wide"), dive({1: samples(120.0, 2, reach=0.45)}, "narrow")
    known = commission_thruster(settings.thruster[0], settings, [wide, narrow], False)
    detector = taught(settings, [known]).state.learnt["thruster 1"].detector
    assert detector.learnt.command.max() > 0.8


def test_what_is_of_the_moment_is_nothing_also_where_the_state_is_young(settings, learnt):
    found = taught(settings, learnt).state
    assert isinstance(found.saved, Moment)
    pipeline = Pipeline(settings)
    pipeline.resume(found.passing)
    assert set(pipeline.levels().values()) <= {Level.UNKNOWN}


def test_false_alarms_of_the_new_configuration_are_counted(settings, learnt):
    found = taught(settings, learnt)
    assert found.faults == 0
    assert 0.0 < found.thruster_hours <= 240.0 / 3600.0


def test_a_thruster_of_which_something_is_missing_is_not_in_it(settings):
    weak = commission_thruster(settings.thruster[0], settings, [dive({1: samples(240.0, reach=0.2)})], False)
    assert taught(settings, [weak]).state.learnt == {}
