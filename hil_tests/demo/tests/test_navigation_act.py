"""The third act without its bus and its links: the rig's readings go straight into the gateway's pipeline."""

from __future__ import annotations

from math import hypot

import pytest

from detectors.navigation import FaultKind, ImuSample, Sensor
from detectors.verdict import Level
from gateway.channel import NavigationJudgement
from gateway.config_sections import MAVLINK
from gateway.pipeline import Pipeline
from hil_tests.demo.configuration import write_config
from hil_tests.demo.plan import DRIFT_MPS2, plan
from hil_tests.demo.tests.rehearsal import Rehearsal
from hil_tests.demo.tracks import track
from hil_tests.demo.trusting import trusting_states

SECONDS = 110.0


@pytest.fixture(scope="module")
def act(tmp_path_factory):
    """Plan, configuration, judgements and the truth."""
    script, config = plan(SECONDS), write_config(tmp_path_factory.mktemp("act"), "unused", 14550)
    pipeline, rehearsal = Pipeline(config), Rehearsal(script, seed=1)
    found = []
    for link, readings in rehearsal.readings():
        if link == MAVLINK:
            found += [one for one in pipeline.feed(link, readings) if isinstance(one, NavigationJudgement)]
    return script, config, found, rehearsal.moments


def test_the_drift_is_found_and_named_and_nothing_else_is_blamed(act):
    script, _, found, _ = act
    assert sum(isinstance(one.sample, ImuSample) for one in found) > 49.0 * SECONDS
    verdicts = [one.verdict for one in found]
    faults = {
        sensor: [verdict.time_s for verdict in verdicts if verdict.of(sensor).level is Level.FAULT]
        for sensor in Sensor
    }
    assert {sensor for sensor, times_s in faults.items() if times_s} == {Sensor.DVL}
    assert script.drift_s < faults[Sensor.DVL][0] < script.drift_s + 18.0
    assert Sensor.DVL in verdicts[-1].isolated
    told = next(verdict for verdict in verdicts if verdict.level is Level.FAULT).of(Sensor.DVL)
    assert told.kind is FaultKind.DRIFT
    assert 0.5 * DRIFT_MPS2 < told.rate < 2.0 * DRIFT_MPS2
    before = [verdict.of(Sensor.DVL).level for verdict in verdicts if 50.0 < verdict.time_s < script.drift_s]
    assert before.count(Level.NORMAL) > 0.9 * len(before)


def test_isolated_the_dvl_leads_nobody_astray(act):
    script, config, found, moments = act
    isolated = track(one.verdict.state for one in found).anchored(moments, script.drift_s)
    trusting = track(trusting_states(config, [one.sample for one in found])).anchored(moments, script.drift_s)
    assert hypot(moments[-1].motion.north_m, moments[-1].motion.east_m) > 20.0
    assert isolated.errors_m(moments)[-1] < 0.5 * trusting.errors_m(moments)[-1]
