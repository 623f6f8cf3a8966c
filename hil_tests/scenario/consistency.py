"""What the parts of a scenario contradict each other in; the vehicle it is for is not looked at here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from hil_tests.scenario.document import Expectation, Prohibition, Scenario
from hil_tests.scenario.entry import names_in
from hil_tests.scenario.failures import PHYSICAL
from hil_tests.scenario.fault import Fault
from hil_tests.yaml_document import Location

# place in the file, what it says, what would be right
Contradiction = tuple[Location, object, str]


def contradictions(scenario: Scenario, entries: Sequence[Mapping[str, Any]] = ()) -> Iterator[Contradiction]:
    """All of them.

    Args:
        scenario: to look at.
        entries: its faults as the file has them; none: as many as the scenario has.
    """
    yield from _of_recording(scenario, entries)
    yield from _too_late(scenario, entries)
    yield from _disordered(scenario)
    for place, expectation in enumerate(scenario.expect):
        yield from _out_of_time(scenario, ("expect", place), expectation)
    for place, prohibition in enumerate(scenario.never):
        yield from _forbidding_nothing(scenario, ("never", place), prohibition)


def places_of_faults(scenario: Scenario, entries: Sequence[Mapping[str, Any]] = ()) -> list[Location]:
    """Where each fault's subject stands in the file: an entry can befall several.

    Args:
        scenario, entries: as of `contradictions`.
    """
    if not entries:
        return [("faults", place, "subject") for place in range(len(scenario.faults))]
    return [
        ("faults", place, "subject", *([] if isinstance(entry["subject"], str) else [number]))
        for place, entry in enumerate(entries)
        for number, _ in enumerate(names_in(entry))
    ]


def _of_recording(scenario: Scenario, entries: Sequence[Mapping[str, Any]]) -> Iterator[Contradiction]:
    if scenario.recording is None:
        return
    for key in ("mission", "water"):
        if key in scenario.model_fields_set:
            yield (key,), None, "a recorded dive has its own: want this or recording"
    for place, fault in _placed(scenario, entries):
        if fault.subject.target in PHYSICAL:
            yield (
                place,
                fault.subject.name,
                "cannot befall a recorded vehicle: want what it reports, or a bus or link",
            )


def _too_late(scenario: Scenario, entries: Sequence[Mapping[str, Any]]) -> Iterator[Contradiction]:
    end_s = scenario.duration_s
    timed = [((*place[:2], "at_s"), fault.at_s) for place, fault in _placed(scenario, entries)]
    timed += [(("mission", "steps", place, "at_s"), step.at_s) for place, step in enumerate(scenario.mission.steps)]
    timed += [(("water", "currents", place, "at_s"), one.at_s) for place, one in enumerate(scenario.water.currents)]
    for location, at_s in dict(timed).items():
        if at_s >= end_s:
            yield location, at_s, f"comes after the end: want less than duration_s = {end_s:g}"


def _placed(scenario: Scenario, entries: Sequence[Mapping[str, Any]]) -> Iterator[tuple[Location, Fault]]:
    return zip(places_of_faults(scenario, entries), scenario.faults, strict=True)


def _disordered(scenario: Scenario) -> Iterator[Contradiction]:
    for place, (one, other) in enumerate(pairwise(scenario.mission.steps), start=1):
        if other.at_s < one.at_s:
            yield ("mission", "steps", place, "at_s"), other.at_s, f"want steps in order: not before {one.at_s:g}"


def _out_of_time(scenario: Scenario, location: Location, expectation: Expectation) -> Iterator[Contradiction]:
    after_s = scenario.first_fault_s if expectation.after_s is None else expectation.after_s
    if after_s >= scenario.duration_s:
        yield (
            (*location, "after_s"),
            after_s,
            f"is after the end: want less than duration_s = {scenario.duration_s:g}",
        )
    elif expectation.within_s is not None and after_s + expectation.within_s > scenario.duration_s:
        left_s = scenario.duration_s - after_s
        yield (*location, "within_s"), expectation.within_s, f"ends after the play: want at most {left_s:g}"


def _forbidding_nothing(scenario: Scenario, location: Location, prohibition: Prohibition) -> Iterator[Contradiction]:
    if prohibition.from_s >= scenario.duration_s:
        yield (*location, "from_s"), prohibition.from_s, f"is after the end: want less than {scenario.duration_s:g}"
    if prohibition.before_s != "fault":
        return
    if not scenario.faults:
        yield (*location, "before_s"), "fault", "there is no fault: want a time, or nothing for to the end"
    elif scenario.first_fault_s <= prohibition.from_s:
        yield (
            (*location, "before_s"),
            "fault",
            f"the first fault is at {scenario.first_fault_s:g}: nothing is forbidden",
        )
