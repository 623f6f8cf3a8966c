"""What is trained on, and how: all that needs no PyTorch."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.tests.dives import dives, record
from gateway.training.records import interval_s, split
from gateway.training.settings import Hyperparameters, Search, TrainingSettings


def test_whole_recordings_are_left_out_by_the_seed():
    records = dives(11)
    training, validation = split(records, seed=3)
    assert len(training) == 9 and len(validation) == 2
    assert sorted(one.name for one in training + validation) == sorted(one.name for one in records)
    assert [one.name for one in split(records, seed=3)[1]] == [one.name for one in validation]
    assert len({tuple(one.name for one in split(records, seed)[1]) for seed in range(10)}) > 3


def test_of_few_recordings_the_last_fifth_of_each_is_left_out():
    training, validation = split([record("dive", count=100)], seed=0)
    assert training[0].time_s.tolist() == list(range(80))
    assert validation[0].time_s.tolist() == list(range(80, 100))
    with pytest.raises(ValueError, match="dive: 2 samples of the DVL: want 3 or more"):
        split([record("dive", count=2)], seed=0)
    with pytest.raises(ValueError, match="no recordings"):
        split([], seed=0)


def test_interval_is_the_usual_one():
    assert interval_s(dives()) == 1.0
    with pytest.raises(ValueError, match="want more"):
        interval_s([record("dive", count=1)])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"features": np.zeros((60, 11))}, r"dive: features: shape \(60, 11\): want \(60, 12\)"),
        ({"innovation": np.full((60, 4), np.inf)}, "dive: innovation: .*all finite"),
        ({"variance": np.zeros((60, 4))}, "dive: variance: want all above 0"),
    ],
)
def test_records_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(record("dive"), **changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Hyperparameters(learning_rate=0.0), "learning_rate = 0.0: want above 0"),
        (lambda: Hyperparameters(hidden=0), "hidden = 0: want 1 or more"),
        (lambda: Search(particles=1), "particles = 1: want 2 or more"),
        (lambda: Search(iterations=0), "iterations = 0: want 1 or more"),
        (lambda: TrainingSettings(seed=-1), "seed = -1: want 0 or more"),
    ],
)
def test_settings_out_of_range_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
