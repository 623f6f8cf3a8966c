"""The second act without its bus and its links: the rig's readings go straight into the gateway's pipeline."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from detectors.verdict import Level
from drivers.readings import Attitude, LocalPosition, ThrusterCommand
from gateway.channel import SpeedJudgement
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.pipeline import Pipeline
from hil_tests.demo.configuration import write_config
from hil_tests.demo.plan import COURSE, Plan, plan
from hil_tests.rig.helm import steer
from hil_tests.rig.navigation import NavigationErrors, NavigationFilter
from hil_tests.rig.pilot import SURVEYING, Pilot
from hil_tests.rig.vehicle import Motion, Vehicle, mix

PERIOD_S = 0.01
SECONDS = 85.0


def drive(script: Plan, seed: int) -> Iterator[tuple[float, list[float], Motion]]:
    """Time, thruster commands and what the autopilot takes for the truth, step by step."""
    surroundings = script.surroundings()
    vehicle = Vehicle(PERIOD_S, seed, script.faults(), water=surroundings.water, hull_faults=surroundings.hull_faults)
    pilot, navigation = Pilot(seed, SURVEYING), NavigationFilter(NavigationErrors(), seed)
    motion = vehicle.hull.motion
    for step in range(round(script.seconds / PERIOD_S)):
        time_s = step * PERIOD_S
        commands = mix(steer(COURSE, time_s, pilot.sticks(time_s), motion))
        motion = vehicle.step(time_s, commands)
        if step % 5 == 0:
            navigation.advance(time_s)
        yield time_s, commands, navigation.seen(motion)


def judgements(config: Config, script: Plan, seed: int) -> list[SpeedJudgement]:
    pipeline = Pipeline(config)
    found = []
    for step, (time_s, commands, seen) in enumerate(drive(script, seed)):
        if step % 2 == 0:
            pushing = enumerate(commands[:4], start=1)
            pipeline.feed("can0", [ThrusterCommand(time_s, number, command) for number, command in pushing])
        readings = []
        if step % 5 == 0:
            readings.append(Attitude(time_s, 0.0, 0.0, seen.yaw_rad, 0.0, 0.0, seen.yaw_rate_radps))
        if step % 10 == 0:
            place = (seen.north_m, seen.east_m, seen.down_m)
            readings.append(LocalPosition(time_s, place, seen.velocity_ned_mps()))
        found += [one for one in pipeline.feed(MAVLINK, readings) if isinstance(one, SpeedJudgement)]
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
    assert verdicts[-1].flow_mps == pytest.approx((0.035, 0.398), abs=0.2)
