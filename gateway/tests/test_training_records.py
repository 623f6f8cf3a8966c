"""What is trained on, and how: all that needs no PyTorch."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.tests.dives import dives, record
from gateway.training.records import interval_s, splits
from gateway.training.settings import Hyperparameters, Search, TrainingSettings


def names(records):
    return [one.name for one in records]


def test_whole_recordings_are_left_out_by_the_seed():
    records = dives(11)
    [(training, validation)] = splits(records, seed=3, count=1)
    assert len(training) == 9 and len(validation) == 2
    assert sorted(names(training + validation)) == sorted(names(records))
    assert names(splits(records, seed=3, count=1)[0].validation) == names(validation)
    assert len({tuple(names(splits(records, seed, 1)[0].validation)) for seed in range(10)}) > 3


@pytest.mark.parametrize("count", [5, 11])
def test_in_five_splits_each_recording_is_left_out_once(count):
    ways = splits(dives(count), seed=1, count=5)
    assert sorted(name for way in ways for name in names(way.validation)) == sorted(names(dives(count)))
    for way in ways:
        assert not set(names(way.training)) & set(names(way.validation))
        assert len(way.training) + len(way.validation) == count
    assert splits(dives(count), seed=1, count=0) == []


def test_of_few_recordings_the_last_fifth_of_each_is_left_out():
    [(training, validation)] = splits([record("dive", count=100)], seed=0, count=5)
    assert training[0].time_s.tolist() == list(range(80))
    assert validation[0].time_s.tolist() == list(range(80, 100))
    with pytest.raises(ValueError, match="dive: 2 samples of the DVL: want 3 or more"):
        splits([record("dive", count=2)], seed=0, count=1)
    with pytest.raises(ValueError, match="no recordings"):
        splits([], seed=0, count=1)


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
        (lambda: TrainingSettings(splits=6), "splits = 6: want 0 to 5"),
        (lambda: TrainingSettings(hyperparameters=None, splits=0), "splits = 0: want 1 to 5"),
    ],
)
def test_settings_out_of_range_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
