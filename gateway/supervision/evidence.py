"""What faults mean for each other: which explains which, which confirms which, and what can no longer be done."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from detectors.verdict import Level
from gateway import texts
from gateway.observation import Observation
from gateway.supervision.actions import RANK, Action, Need, Plan, possible, sends
from gateway.supervision.autopilots import REQUESTS, AutopilotKind
from gateway.supervision.subject import Subject

# Detectors that look at the same trouble through other instruments: RPM over one link, heading and position over
# another. A forged frame can deceive one of them.
CONFIRMED_BY: Mapping[str, str] = {"thruster": "speed", "speed": "thruster"}

# With less of it the depth cannot be held: of two vertical thrusters ArduSub needs one (it was seen to hold with it)
VERTICAL_LEFT_MIN = 0.5

DEPTH_SENSOR = "depth sensor"
# A position that is dead reckoning needs all of them.
POSITION_SENSORS = frozenset({"dvl", "gyroscope", "accelerometer", "navigation"})

MANY = 3


@dataclass(frozen=True, slots=True)
class Geometry:
    """Which thruster drives the vehicle where, by subject, as shares of its thrust; empty = not known.

    Attributes:
        vertical: up or down.
        horizontal: ahead or to the side.
    """

    vertical: Mapping[str, float] = field(default_factory=dict)
    horizontal: Mapping[str, float] = field(default_factory=dict)

    def vertical_left(self, faulty: Iterable[str]) -> float:
        """Share of the vertical thrust that is left, 1 where the thrusters are not known."""
        total = sum(self.vertical.values())
        lost = sum(self.vertical.get(subject, 0.0) for subject in set(faulty))
        return 1.0 if total <= 0.0 else 1.0 - lost / total

    def drives(self, subject: str) -> bool:
        """Whether a thruster has to do with the speed through the water; where none is known to, each may."""
        return not self.horizontal or self.horizontal.get(subject, 0.0) > 0.0


def plan(subjects: Sequence[Subject], geometry: Geometry, kind: AutopilotKind | None = None) -> Plan | None:
    """What should be done now: the worst of what the unsettled faults ask for; None: nothing.

    Args:
        subjects: all of them.
        geometry: which thruster drives the vehicle where.
        kind: what the autopilot does not know at all is left out; None or another one: nothing is.
    """
    faulty = [subject for subject in subjects if subject.level is Level.FAULT]
    missing = set(_missing(faulty, geometry))
    detectors = [subject.seen.detector for subject in faulty]
    confirmed = _confirmed(faulty, geometry)
    candidates: list[Plan] = []
    for subject in faulty:
        if subject.settled:
            continue
        detector, policy = subject.seen.detector, subject.policy
        ladder = policy.several if policy.several and detectors.count(detector) > 1 else policy.ladder
        alone = set() if subject in confirmed else {Need.EVIDENCE}
        actions, left_out = possible(_known(ladder, kind), missing | alone)
        if any(sends(action) for action in ladder):
            label = together([one.seen.label for one in faulty if one.seen.detector == detector])
            candidates.append(Plan(label, actions, left_out, Need.POSITION not in missing))
    return max(candidates, key=lambda one: RANK[one.actions[0]] if one.actions else 0, default=None)


def _known(ladder: Sequence[Action], kind: AutopilotKind | None) -> Sequence[Action]:
    """What this autopilot can be asked for; all of it where that is nothing, for the pilot is told so."""
    return [action for action in ladder if (kind, action) in REQUESTS] or ladder


def _confirmed(faulty: Iterable[Subject], geometry: Geometry) -> list[Subject]:
    """The faults of which there is a second kind of evidence: a slow vehicle, and thrusters that make it slow."""
    related = [one for one in faulty if one.seen.confirms and _drives(one, geometry)]
    detectors = {one.seen.detector for one in related}
    return [one for one in related if CONFIRMED_BY.get(one.seen.detector) in detectors]


def _drives(subject: Subject, geometry: Geometry) -> bool:
    return subject.seen.detector != "thruster" or geometry.drives(subject.seen.subject)


def _missing(faulty: Iterable[Subject], geometry: Geometry) -> Iterator[Need]:
    names = {subject.seen.subject for subject in faulty}
    if geometry.vertical_left(names) < VERTICAL_LEFT_MIN:
        yield Need.VERTICAL_THRUST
    if DEPTH_SENSOR in names:
        yield Need.DEPTH
    if names & POSITION_SENSORS:
        yield Need.POSITION


def explaining(subjects: Iterable[Subject], geometry: Geometry) -> list[Subject]:
    """The thrusters whose trouble explains that the vehicle is slow."""
    return [
        one
        for one in subjects
        if one.seen.detector == "thruster" and one.level >= Level.SUSPECT and geometry.drives(one.seen.subject)
    ]


def one_cause(causes: Sequence[Observation], speed: Observation) -> str:
    """A thruster's trouble and a slow vehicle as one text: `T3 entangled: speed 0.52 m/s, want 0.9-1.2`."""
    label = together([cause.label for cause in causes])
    # two kinds of evidence agree: no longer a question
    trouble = causes[0].trouble.rstrip("?") if len({cause.trouble for cause in causes}) == 1 else "faulty"
    measured, *wanted = speed.trouble.rstrip("?").split(", ", 1)
    return texts.fitted(f"{label} {trouble}: speed {measured}", [f", {one}" for one in wanted], "")


def together(labels: Sequence[str]) -> str:
    """Several labels in few characters: `T3+T5`."""
    return "+".join(labels) if len(labels) <= MANY else f"{len(labels)} faults"
