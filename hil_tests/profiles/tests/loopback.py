"""A world whose autopilot and ESCs hear each other, with nothing in between and no gateway."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

from drivers.can.frame import CanFrame
from hil_tests.profiles import Profile, load_profile
from hil_tests.rig.world import World
from hil_tests.scenario.document import Mission, Scenario
from hil_tests.scenario.fault import Fault, subject_named

START_S = 1_700_000_000.0
PERIOD_S = 0.02

profile = cache(load_profile)


@dataclass(slots=True)
class Heard:
    """All that a world has sent."""

    commands: list[CanFrame] = field(default_factory=list)
    reports: list[CanFrame] = field(default_factory=list)
    datagrams: list[tuple[float, bytes]] = field(default_factory=list)


def fault(subject: str, failure: str, at_s: float = 0.0, **how) -> Fault:
    times = {name: how.pop(name) for name in ("until_s", "ramp_s") if name in how}
    return Fault(subject=subject_named(subject), failure=failure, at_s=at_s, values=how, **times)


def world(vehicle: str | Profile = "bench_rov", *, seed=1, mission=None, faults=(), autopilot=True, **parts) -> World:
    what = profile(vehicle) if isinstance(vehicle, str) else vehicle
    scenario = Scenario(duration_s=3600.0, seed=seed, mission=mission or Mission(), faults=tuple(faults), **parts)
    return World(scenario, what, START_S, autopilot=autopilot)


def run(played: World, until_s: float, from_s: float = 0.0, period_s: float = PERIOD_S) -> Heard:
    """Let it run between two times since the start."""
    heard = Heard()
    for step in range(round(from_s / period_s), round(until_s / period_s) + 1):
        played.advance(START_S + step * period_s)
        commands = played.sent_by_autopilot()
        played.to_devices(commands)
        heard.commands += commands
        heard.reports += played.sent_by_devices()
        heard.datagrams += played.datagrams()
    return heard
