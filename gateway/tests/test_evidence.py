"""What faults mean for each other: which explains and confirms which, and what can no longer be done."""

import math
from dataclasses import replace

import pytest

from detectors.speed import PoseSample
from detectors.speed.sample import SpeedVerdict
from detectors.verdict import Level
from gateway.channel import SpeedJudgement
from gateway.observation import Observation
from gateway.rules import observations
from gateway.supervision.actions import Action, Plan
from gateway.supervision.debounce import Debounce, DebounceTimes
from gateway.supervision.evidence import Geometry, explaining, one_cause, plan, together
from gateway.supervision.subject import Policy, Subject

AT_ONCE = DebounceTimes(0.0, 0.0, 0.0)
# BlueROV2 Heavy: 1 to 4 horizontal, 5 to 8 vertical; here with two of these
GEOMETRY = Geometry({"thruster 5": 1.0, "thruster 6": 1.0}, {"thruster 1": 0.7, "thruster 2": 0.7, "thruster 3": 0.7})
LABELS = {"vehicle": ("speed", "Speed"), "dvl": ("navigation", "DVL"), "depth sensor": ("navigation", "Depth")}


def subject(
    name: str, *ladder: Action, level: Level = Level.FAULT, several: tuple[Action, ...] = (), settled: bool = False
) -> Subject:
    detector, label = LABELS.get(name, ("thruster", f"T{name.rsplit(maxsplit=1)[-1]}"))
    seen = Observation(0.0, detector, name, label, level, 1.0, "entangled?")
    policy = Policy(AT_ONCE, ladder=ladder or (Action.WARN,), several=several)
    return Subject(policy, Debounce(AT_ONCE), seen, level, settled=settled)


def planned(*subjects: Subject, geometry: Geometry = GEOMETRY) -> Plan | None:
    return plan(subjects, geometry)


def test_nothing_is_planned_for_what_is_no_fault_is_settled_or_only_told():
    assert planned() is None
    assert planned(subject("thruster 1", Action.HOLD, level=Level.SUSPECT)) is None
    assert planned(subject("thruster 1", Action.HOLD, settled=True)) is None
    assert planned(subject("thruster 1", Action.WARN), subject("thruster 2", Action.NONE)) is None


def test_the_worst_wins():
    both = [subject("thruster 1", Action.MANUAL), subject("dvl", Action.HOLD)]
    for order in (both, both[::-1]):
        assert planned(*order) == Plan("DVL", (Action.HOLD,), "", position_trusted=False)


def test_several_thrusters_are_another_policy_than_one():
    first, second = (subject(f"thruster {n}", Action.MANUAL, several=(Action.HOLD, Action.MANUAL)) for n in (1, 2))
    assert planned(first) == Plan("T1", (Action.MANUAL,))
    assert planned(first, second) == Plan("T1+T2", (Action.HOLD, Action.MANUAL))


def test_a_settled_thruster_still_counts_among_several():
    first = subject("thruster 1", Action.WARN, several=(Action.HOLD,), settled=True)
    second = subject("thruster 2", Action.WARN, several=(Action.HOLD,))
    assert planned(first, second) == Plan("T1+T2", (Action.HOLD,))


@pytest.mark.parametrize(
    ("dead", "possible"),
    [(("thruster 5",), True), (("thruster 5", "thruster 6"), False), (("thruster 1", "thruster 2"), True)],
)
def test_without_vertical_thrust_the_depth_is_not_held(dead, possible):
    found = planned(*(subject(name, Action.HOLD, Action.MANUAL) for name in dead))
    assert found is not None
    assert found.actions == ((Action.HOLD, Action.MANUAL) if possible else (Action.MANUAL,))
    assert found.left_out == ("" if possible else "Hold not asked: no vertical thrust")


def test_with_a_faulty_depth_sensor_the_depth_is_not_held():
    found = planned(subject("depth sensor", Action.HOLD, Action.MANUAL))
    assert found == Plan("Depth", (Action.MANUAL,), "Hold not asked: depth not known")


def test_nothing_is_left_of_a_plan_whose_actions_are_all_pointless():
    found = planned(subject("depth sensor", Action.HOLD))
    assert found == Plan("Depth", (), "Hold not asked: depth not known")


@pytest.mark.parametrize("action", [Action.SURFACE, Action.LAND, Action.DISARM, Action.TERMINATE])
def test_above_hold_only_with_two_kinds_of_evidence(action):
    thruster, speed = subject("thruster 1", action, Action.HOLD), subject("vehicle", action, Action.HOLD)
    for alone in ([thruster], [speed], [thruster, subject("thruster 2")], [speed, subject("dvl")]):
        assert planned(*alone).actions[0] is Action.HOLD
    assert planned(thruster, speed).actions[0] is action
    assert planned(thruster, subject("vehicle", level=Level.SUSPECT)).actions[0] is Action.HOLD


def test_a_vertical_thruster_is_no_evidence_for_a_slow_vehicle_nor_the_other_way_round():
    """RPM of one that has nothing to do with the speed can be forged while something else slows the vehicle."""
    vertical, speed = (
        subject("thruster 5", Action.DISARM, Action.HOLD),
        subject("vehicle", Action.DISARM, Action.HOLD),
    )
    assert planned(vertical, speed).actions == (Action.HOLD,)
    horizontal = subject("thruster 1", Action.DISARM)
    assert planned(vertical, horizontal, speed).actions[0] is Action.DISARM


def test_where_nobody_knows_what_a_thruster_does_each_may_slow_the_vehicle():
    found = planned(subject("thruster 5", Action.DISARM), subject("vehicle"), geometry=Geometry())
    assert found.actions == (Action.DISARM,)


def test_a_navigation_fault_has_no_second_evidence():
    found = planned(subject("dvl", Action.DISARM), subject("thruster 1"), subject("vehicle"))
    assert found == Plan("DVL", (), "Disarm not asked: one kind of evidence only", position_trusted=False)


@pytest.mark.parametrize(
    ("faulty", "left"), [((), 1.0), (("thruster 5",), 0.5), (("thruster 5", "thruster 6", "thruster 1"), 0.0)]
)
def test_vertical_thrust_that_is_left(faulty, left):
    assert GEOMETRY.vertical_left(faulty) == left
    assert Geometry().vertical_left(faulty) == 1.0


def test_thrusters_that_explain_a_slow_vehicle():
    horizontal, suspected = subject("thruster 1"), subject("thruster 2", level=Level.SUSPECT)
    others = [subject("thruster 5"), subject("thruster 3", level=Level.NORMAL), subject("dvl")]
    assert explaining([horizontal, suspected, *others], GEOMETRY) == [horizontal, suspected]


def observed(label: str, trouble: str) -> Observation:
    return Observation(0.0, "thruster", "x", label, Level.FAULT, math.nan, trouble)


def test_one_cause_in_one_text():
    speed = observed("Speed", "0.52 m/s, want 0.9-1.2")
    assert one_cause([observed("T3", "entangled?")], speed) == "T3 entangled: speed 0.52 m/s, want 0.9-1.2"
    two = [observed("T3", "entangled?"), observed("T4", "worn?")]
    assert one_cause(two, speed) == "T3+T4 faulty: speed 0.52 m/s, want 0.9-1.2"


def test_a_number_is_left_out_rather_than_cut():
    speed = observed("Speed", "-0.12 m/s, want 0.10-0.45")
    three = [observed(label, "entangled?") for label in ("T10", "T11", "T12")]
    assert one_cause(three, speed) == "T10+T11+T12 entangled: speed -0.12 m/s"


def test_many_labels_are_counted():
    assert together(["T1"]) == "T1"
    assert together(["T1", "T2", "T3"]) == "T1+T2+T3"
    assert together(["T1", "T2", "T3", "T4"]) == "4 faults"


def test_a_vehicle_that_is_too_fast_confirms_no_thruster():
    thruster, fast = subject("thruster 1", Action.TERMINATE), subject("vehicle", Action.TERMINATE)
    assert planned(thruster, fast).actions == (Action.TERMINATE,)
    fast.seen = replace(fast.seen, confirms=False)
    assert planned(thruster, fast).actions == ()


@pytest.mark.parametrize(
    ("speed_mps", "low_mps", "high_mps", "slow"),
    [
        (0.5, 0.8, 1.2, True),
        (4.0, 0.8, 1.2, False),
        (-0.5, -1.2, -0.8, True),
        (-2.0, -1.2, -0.8, False),
        (math.nan, 0.8, 1.2, False),
        (0.5, math.nan, math.nan, False),
    ],
)
def test_what_is_slow(speed_mps, low_mps, high_mps, slow):
    verdict = SpeedVerdict(
        time_s=1.0,
        level=Level.FAULT,
        score=1.2,
        speed_mps=speed_mps,
        flow_mps=(0.0, 0.0),
        flag=1,
        speed_min_mps=low_mps,
        speed_max_mps=high_mps,
    )
    (observed,) = observations(SpeedJudgement(PoseSample(1.0, 0.0, 0.0, 0.0), verdict))
    assert observed.confirms is slow
