"""Readings in the order of a recording, that of their arrival: links and this program overtake each other."""

from __future__ import annotations

import random
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from drivers.reading_block import ReadingBlock
from drivers.readings import OwnClock, Reading, ThrusterCommand
from gateway.pipeline import Arrival, Factories, Pipeline
from gateway.stretches.stretch import BlockArrival, Stretch
from gateway.tests.conftest import CruiseDetector, GroundSpeedDetector, ThresholdDetector
from gateway.tests.test_stretch import START_S, block, dive, outcome
from gateway.tests.test_stretch_vehicles import Dive, vehicle

__all__ = ["vehicle"]  # the fixture

FAKES = Factories(ThresholdDetector, GroundSpeedDetector, CruiseDetector)
Told = tuple[str, Reading]


def arriving(by_link: dict[str, list[Reading]], seed: int, ticking: bool = True) -> list[Told]:
    """As a run gets them: each link in its order, milliseconds late, now and then far more; and the time itself."""
    chance = random.Random(seed)
    due: list[tuple[float, int, Told]] = []
    for link, readings in by_link.items():
        latest_s = 0.0
        for reading in readings:
            late_s = chance.choice((0.0, 0.002, 0.03)) if chance.random() < 0.999 else chance.choice((0.4, 1.5))
            latest_s = max(latest_s, min(reading.time_s, START_S + 100.0) + late_s)
            due.append((latest_s, len(due), (link, reading)))
    end_s = max(at_s for at_s, _, _ in due)
    for n in range(round(10.0 * (end_s - START_S)) if ticking else 0):
        now_s = START_S + 0.1 * n + 0.013
        due.append((now_s, len(due), ("gateway", OwnClock(now_s - 0.1))))
    return [told for _, _, told in sorted(due, key=lambda one: one[:2])]


def stretches(told: list[Told], length: int) -> list[list[BlockArrival]]:
    """Cut anywhere; every third place is another one's."""
    cut = []
    for begin in range(0, len(told), length):
        places, readings = defaultdict(list), defaultdict(list)
        for place, (link, reading) in enumerate(told[begin : begin + length]):
            places[link].append(3.0 * place)
            readings[link].append(reading)
        cut.append([BlockArrival(link, block(readings[link]), np.array(places[link])) for link in readings])
    return cut


def compare(config, told: list[Told], length: int, factories: Factories) -> list[str]:
    quiet = replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))
    slow, fast = Pipeline(quiet, factories), Pipeline(quiet, factories)
    singles = [one for link, reading in told for one in slow.take([Arrival(link, [reading])])]
    blocks = [one for arrivals in stretches(told, length) for one in fast.take_stretch(arrivals)]
    assert outcome(fast, blocks) == outcome(slow, singles)
    assert repr(fast.newest) == repr(slow.newest)
    return outcome(slow, singles)[0]


@pytest.mark.parametrize("length", [150, 2000, 100_000])
@pytest.mark.parametrize("seed", range(4))
def test_what_arrives_late_on_three_links_is_taken_in_its_order(vehicle, seed, length):
    lines = compare(vehicle, arriving(Dive(seed, 20.0).by_link, seed), length, FAKES)
    assert any('"FAULT"' in line or '"SUSPECT"' in line for line in lines)


@pytest.mark.parametrize("ticking", [False, True])
def test_a_bus_that_is_ahead_of_the_other_link(config, ticking):
    compare(config, arriving(dive(5, 20.0), 5, ticking), 700, FAKES)


def test_with_the_real_detectors(vehicle):
    compare(vehicle, arriving(Dive(101, 20.0).by_link, 101), 3000, Factories())


def test_most_such_stretches_pass_as_columns(vehicle, monkeypatch):
    """One by one, a long dive would take a hundred times as long."""
    whole = Pipeline.take
    fallen_back = []
    monkeypatch.setattr(Pipeline, "take", lambda *given: fallen_back.append(1) or whole(*given))
    pipeline, cut = Pipeline(vehicle, FAKES), stretches(arriving(Dive(3, 20.0).by_link, 3), 400)
    for arrivals in cut:
        pipeline.take_stretch(arrivals)
    assert len(fallen_back) < len(cut) / 2


def test_a_place_counts_and_not_the_time():
    told = [("can0", ThrusterCommand(2.0, 1, 0.1)), ("can1", ThrusterCommand(1.0, 1, 0.2))]
    stretch = Stretch.of(stretches(told, 10)[0])
    assert [link for _, link, _ in stretch.readings()] == ["can0", "can1"]


def test_places_of_some_arrivals_only_are_refused():
    with pytest.raises(ValueError, match="places of all"):
        Stretch.of([BlockArrival("can0", ReadingBlock(), np.empty(0)), BlockArrival("can1", ReadingBlock())])
