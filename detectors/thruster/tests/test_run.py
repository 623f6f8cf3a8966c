"""`run` in any pieces, mixed with `update`, says what the loop over `update` says, bit for bit."""

import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from detectors.thruster import CommissionedCurve, ThrusterConfig, ThrusterDetector, ThrusterVerdicts
from detectors.thruster.tests.simulation import Series, Thruster, cruising, lasting, working

COUNT = 900
CONFIGS = {
    "exact": ThrusterConfig(),
    "swarm": ThrusterConfig(search="swarm", window_min=100, window_max=800, warmup=200),
    "fixed threshold": ThrusterConfig(threshold_rpm=150.0),
    "paper": ThrusterConfig(
        dynamics=False, threshold_rpm=400.0, window_min=30, window_max=120, warmup=150, order_max=3
    ),
}


def simulated(name: str) -> Series:
    if name == "both ways":
        return Thruster(dead_band=0.05, signed=False).simulate(working(COUNT, 3), seed=3)
    gain = lasting(COUNT, 700, 0.75, 850) if name != "healthy" else 1.0
    supply = np.linspace(16.8, 15.0, COUNT) if name == "measured" else None
    series = Thruster().simulate(cruising(COUNT, 3), gain=gain, voltage_v=supply, current=name == "measured", seed=3)
    if name == "measured":
        return series.spoiled(slice(300, 500), voltage_v=np.nan).spoiled(slice(600, 710), current_a=np.nan)
    if name == "gaps":
        later = np.cumsum(np.isin(np.arange(COUNT), [120, 450, 720, 721, 900])) * 7.3
        return replace(series, time_s=series.time_s + later)
    if name == "refused":
        return (
            series.spoiled(list(range(5, COUNT, 41)), speed_rpm=np.nan)
            .spoiled(list(range(0, COUNT, 53)), command=-np.inf)
            .spoiled([*range(400, 404), 710, 711, COUNT - 1], time_s=3.0)
            .spoiled([500, 800], time_s=np.nan)
            .spoiled([300, 720], speed_rpm=1e200)
        )
    return series


SERIES = ("healthy", "faulty", "both ways", "measured", "gaps", "refused")


def assert_identical(verdicts: ThrusterVerdicts, expected: ThrusterVerdicts) -> None:
    for name in ThrusterVerdicts.__slots__:
        np.testing.assert_array_equal(getattr(verdicts, name), getattr(expected, name), err_msg=name, strict=False)


def gathered(verdicts) -> ThrusterVerdicts:
    columns = {}
    for name in ThrusterVerdicts.__slots__:
        values = [getattr(verdict, name) for verdict in verdicts]
        columns[name] = np.array(values, dtype=getattr(ThrusterVerdicts.blank(0), name).dtype)
    return ThrusterVerdicts(**columns)


@cache
def looped(config: str, series: str) -> tuple[ThrusterVerdicts, dict[str, int]]:
    detector = ThrusterDetector(CONFIGS[config])
    verdicts = gathered([detector.update(sample) for sample in simulated(series).samples()])
    return verdicts, dict(detector.refused)


@pytest.mark.parametrize(
    ("config", "series"),
    [("exact", series) for series in SERIES]
    + [(config, series) for config in CONFIGS if config != "exact" for series in ("faulty", "refused")],
)
def test_run_equals_the_loop(config, series):
    detector = ThrusterDetector(CONFIGS[config])
    expected, refused = looped(config, series)
    assert_identical(detector.run(*simulated(series).arguments), expected)
    assert dict(detector.refused) == refused
    assert bool(refused) == (series == "refused")


@settings(max_examples=6, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    series=st.sampled_from(SERIES),
    cuts=st.lists(st.integers(0, COUNT), max_size=8),
    how=st.lists(st.sampled_from(["run", "run", "update", "pickle"]), min_size=9, max_size=9),
)
def test_in_any_pieces(series, cuts, how):
    whole = simulated(series)
    detector, said = ThrusterDetector(), []
    edges = [0, *sorted(cuts), COUNT]
    for start, stop, way in zip(edges, edges[1:], how, strict=False):
        piece = whole[start:stop]
        if way == "pickle":
            detector = pickle.loads(pickle.dumps(detector))  # noqa: S301
        if way == "update":
            said += [detector.update(sample) for sample in piece.samples()]
        else:
            verdicts = detector.run(*piece.arguments)
            said += [verdicts.row(number) for number in range(len(verdicts))]
    expected, refused = looped("exact", series)
    assert_identical(gathered(said), expected)
    assert dict(detector.refused) == refused


def test_accept_at_the_same_sample_is_the_same_in_both():
    series = simulated("faulty")
    one, other = ThrusterDetector(), ThrusterDetector()
    for sample in series[:800].samples():
        one.update(sample)
    other.run(*series[:800].arguments)
    one.accept()
    other.accept()
    assert one.commissioned == other.commissioned
    assert isinstance(one.commissioned, CommissionedCurve)
    after = [one.update(sample) for sample in series[800:].samples()]
    assert_identical(other.run(*series[800:].arguments), gathered(after))


def test_run_leaves_its_arguments_alone():
    series = simulated("measured")
    before = [column.copy() for column in series.arguments]
    ThrusterDetector().run(*series.arguments)
    for column, copy in zip(series.arguments, before, strict=True):
        np.testing.assert_array_equal(column, copy)


def test_run_of_nothing_is_nothing():
    detector = ThrusterDetector()
    assert len(detector.run([], [], [])) == 0
    assert len(detector.run([1.0], [0.5], [900.0])) == 1


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (([0.0, 1.0], [0.0], [0.0, 1.0]), r"command .*\(1,\).*\(2,\)"),
        (([0.0], [0.0], [[0.0]]), "speed_rpm"),
        (([0.0], [0.0], [0.0], [16.0, 16.0]), "voltage_v"),
        (([0.0], [0.0], [0.0], None, [1.0, 2.0]), "current_a"),
        ((0.0, 0.0, 0.0), "one-dimensional"),
    ],
)
def test_run_refuses_arrays_that_do_not_belong_together(arguments, named):
    with pytest.raises(ValueError, match=named):
        ThrusterDetector().run(*arguments)
