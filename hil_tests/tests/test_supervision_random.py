"""Dives on which anything may happen at any time; whatever it is, some things must never be done."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from itertools import combinations, pairwise

import pytest

from drivers.mavlink.messages import CommandLong, CompanionHeartbeat, StatusText
from gateway.severity import Severity
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.commander import Commander
from hil_tests.rig.commands import Command, Result
from hil_tests.rig.conduct import NOT_SHOWN, SILENCE, Reply
from hil_tests.rig.link_conditions import IDEAL, LinkConditions
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.tests.scene import configuration
from hil_tests.tests.virtual_rig import PERIOD_S, START_S, Sent, VirtualRig

DIVE_S = 60.0
INTERVAL_S = 20.0
HEARD_FOR_S = 5.0
OWN_FAILSAFE = {5, 6, 8}  # MAV_STATE critical, emergency, flight termination
FORCE_ARM = 2989.0
TEXTS_IN_10_S = 20
LADDERS = ('["hold"]', '["surface", "hold"]', '["hold", "manual"]', '["disarm", "hold"]', '["terminate"]', '["warn"]')
LINKS = (IDEAL, LinkConditions(loss=0.2), LinkConditions(latency_s=0.5, jitter_s=0.2, loss=0.1, duplication=0.1))
REPLIES = (
    SILENCE,
    NOT_SHOWN,
    Reply(Result.DENIED),
    Reply(Result.TEMPORARILY_REJECTED),
    Reply(Result.ACCEPTED, obeyed=True, after_s=2.0),
    Reply(None, obeyed=True),
)
MODES: Mapping[type[Commander], tuple[object, ...]] = {
    ArduSub: (Mode.MANUAL, Mode.STABILIZE, Mode.ALT_HOLD),
    Px4: (MainMode.MANUAL, MainMode.ACRO, MainMode.ALTCTL),
}


def dive(seed: int, folder) -> VirtualRig:
    """A dive of which the seed decides everything; at its end all that was said and asked."""
    chance = random.Random(seed)
    make = chance.choice([ArduSub, Px4])
    ladders = (f"{key} = {chance.choice(LADDERS)}\n" for key in ("thruster_fault", "thrusters_fault", "speed_fault"))
    failsafe = "".join(ladders) + f"delay_s = {chance.choice([0, 3])}\ninterval_s = {INTERVAL_S}\n"
    rig = VirtualRig(configuration(folder, failsafe, speed=True), make(), chance.choice(LINKS), seed)
    happenings = events(rig, chance)
    rig.run(7.0)
    while rig.time_s < START_S + DIVE_S:
        rig.run(chance.choice([0.3, 1.0, 3.0, 8.0]))
        chance.choice(happenings)()
    return rig


def events(rig: VirtualRig, chance: random.Random) -> list[Callable[[], object]]:
    """All that may happen."""
    scene, commander, autopilot = rig.scene, rig.commander, rig.autopilot

    def become(name: str, value: object, of: object) -> Callable[[], None]:
        return lambda: setattr(of, name, value)

    return [
        lambda: scene.entangle(chance.randint(1, 4)),
        lambda: scene.entangle(1),
        scene.free,
        become("speed_mps", 0.5, scene),
        become("armed", True, commander),
        become("armed", True, commander),
        become("armed", False, commander),
        become("failsafe", True, commander),
        become("failsafe", False, commander),
        lambda: setattr(commander, "mode", chance.choice(MODES[type(commander)])),
        lambda: autopilot.restart(rig.time_s, chance.choice([1.0, 6.0])),
        lambda: autopilot.conduct.then(chance.choice([176, 185, 400]), chance.choice(REPLIES)),
        lambda: chance.choice([rig.up, rig.down]).cut(rig.time_s),
        lambda: (rig.up.mend(), rig.down.mend()),
        lambda: rig.operator(chance.choice([31010, 31011, 31012]), chance.choice([0.0, 1.0, 101.0]), 30.0),
    ]


def commands(rig: VirtualRig) -> list[tuple[Sent, CommandLong]]:
    """What was asked that acts on the vehicle."""
    asked = [(one, one.message) for one in rig.sent if isinstance(one.message, CommandLong)]
    return [(one, message) for one, message in asked if message.command in set(Command)]


@pytest.mark.parametrize("seed", range(8))
def test_whatever_happens(seed, tmp_path):
    rig = dive(seed, tmp_path)
    for one, message in commands(rig):
        assert one.heard is not None and one.heard.armed
        assert one.heard.system_status not in OWN_FAILSAFE
        assert one.time_s - one.heard.time_s <= HEARD_FOR_S + PERIOD_S
        assert message.command != Command.COMPONENT_ARM_DISARM or message.parameters[0] == 0.0
        assert FORCE_ARM not in message.parameters
    first = [(one.time_s, message) for one, message in commands(rig) if message.confirmation == 0]
    for (earlier_s, earlier), (later_s, later) in combinations(first, 2):
        # an action is asked in one step, and its first command goes out within it or the next
        assert earlier != later or later_s - earlier_s > INTERVAL_S - 2 * PERIOD_S
    texts = [(one.time_s, one.message) for one in rig.sent if isinstance(one.message, StatusText)]
    for n, (time_s, text) in enumerate(texts):
        assert text.severity in {Severity.CRITICAL, Severity.ERROR, Severity.WARNING, Severity.NOTICE, Severity.INFO}
        assert sum(later_s < time_s + 10.0 for later_s, _ in texts[n:]) <= TEXTS_IN_10_S
    beats_s = [one.time_s for one in rig.sent if isinstance(one.message, CompanionHeartbeat)]
    assert all(later_s - earlier_s < 1.5 for earlier_s, later_s in pairwise(beats_s))


def test_something_happens(tmp_path):
    dives = [dive(seed, tmp_path) for seed in range(3)]
    assert sum(len(commands(rig)) for rig in dives) > 0
    assert sum(not one.heard.armed for rig in dives for one in rig.sent if one.heard) > 0
