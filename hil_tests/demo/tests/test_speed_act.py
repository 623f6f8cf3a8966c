"""The second act without its bus and its links: the rig's readings go straight into the gateway's pipeline."""

from __future__ import annotations

import pytest

from detectors.verdict import Level
from gateway.channel import SpeedJudgement
from gateway.config import Config
from gateway.pipeline import Pipeline
from hil_tests.demo.configuration import write_config
from hil_tests.demo.plan import Plan, plan
from hil_tests.demo.tests.rehearsal import Rehearsal

SECONDS = 85.0


def judgements(config: Config, script: Plan, seed: int) -> list[SpeedJudgement]:
    pipeline = Pipeline(config)
    found = []
    for link, readings in Rehearsal(script, seed).readings():
        found += [one for one in pipeline.feed(link, readings) if isinstance(one, SpeedJudgement)]
    return found


@pytest.mark.parametrize("seed", [1, 14])
def test_the_net_is_found_and_neither_weeds_nor_current_are_called_a_fault(tmp_path, seed):
    script = plan(SECONDS)
    verdicts = [one.verdict for one in judgements(write_config(tmp_path, "unused", 14550), script, seed)]
    assert len(verdicts) > 9.0 * SECONDS
    fault = next(verdict for verdict in verdicts if verdict.level is Level.FAULT)
    assert script.net_s < fault.time_s < script.net_s + 15.0
    assert fault.speed_mps < fault.speed_min_mps
    quiet = [verdict.level for verdict in verdicts if 20.0 < verdict.time_s < script.net_s]
    assert quiet.count(Level.NORMAL) > 0.8 * len(quiet)
    assert verdicts[-1].level is Level.FAULT
    assert verdicts[-1].flow_mps[:2] == pytest.approx((0.035, 0.398), abs=0.2)
