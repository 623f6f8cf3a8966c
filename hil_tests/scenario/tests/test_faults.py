"""The table of failures, and faults that are checked against it."""

from __future__ import annotations

from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.scenario.document import Scenario
from hil_tests.scenario.entry import Beginning, entries_of, faults_of
from hil_tests.scenario.failures import TABLE, FailureKind, Quantity, Target, kinds_of
from hil_tests.scenario.fault import SINGLE, Fault, Subject, subject_named
from hil_tests.scenario.loading import dump_scenario, parse_scenario
from hil_tests.scenario.template import TYPICAL

NAMES = {Target.THRUSTER: "thruster 3", Target.RPM: "thruster 3 rpm", Target.COMMAND: "thruster 12 command"}
NAMES |= {Target.BUS: "can0"} | {target: name for name, target in SINGLE.items()}
ROWS = pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row.target}-{row.failure}")


def needed(row: FailureKind) -> dict[str, float]:
    """Sizes where the table has no default."""
    return {one.name: TYPICAL[one.name] for one in row.quantities if one.default is None}


def test_every_target_has_a_name_and_failures() -> None:
    assert set(NAMES) == set(Target)
    assert all(kinds_of(target) for target in Target)
    assert all(subject_named(name).target is target for target, name in NAMES.items())


def test_no_failure_is_there_twice() -> None:
    assert len({(row.target, row.failure) for row in TABLE}) == len(TABLE)


@ROWS
def test_quantities_are_no_keys_of_all_faults(row: FailureKind) -> None:
    names = [quantity.name for quantity in row.quantities]
    assert len(set(names)) == len(names)
    assert not {*names} & {*Beginning.model_fields, "axis"}


@ROWS
def test_every_row_loads_with_its_defaults(row: FailureKind) -> None:
    entry = {"at_s": 3, "subject": NAMES[row.target], "failure": row.failure, **needed(row)}
    text = "\n    ".join(f"{key}: {value}" for key, value in entry.items())
    (fault,) = parse_scenario(f"duration_s: 9\nfaults:\n  - {text}\n", Path("/nowhere")).faults
    assert fault.kind is row
    assert fault.values == {
        one.name: TYPICAL.get(one.name) if one.default is None else one.default for one in row.quantities
    }
    assert all(quantity.allows(fault.values[quantity.name]) for quantity in row.quantities)


@ROWS
def test_each_quantity_is_held_to_its_bounds(row: FailureKind) -> None:
    for quantity in row.quantities:
        for value in (quantity.minimum - 1.0, quantity.maximum + 1.0, nan, 1e300):
            with pytest.raises(ValueError, match=f"{quantity.name} = "):
                fault(row, {quantity.name: value})


def fault(row: FailureKind, values: dict[str, float], **fields: Any) -> Fault:
    subject = subject_named(NAMES[row.target])
    return Fault(subject=subject, failure=row.failure, at_s=1.0, values=needed(row) | values, **fields)


@pytest.mark.parametrize(
    ("fields", "wanted"),
    [
        ({"failure": "frozen"}, "failure = frozen: no failure of a dvl, did you mean stuck?"),
        ({"failure": "bias"}, "bias_mps: missing, want a number of at most 1000000"),
        ({"values": {"bias": 3.0}}, "bias = 3.0: want no quantity of stuck"),
        ({"at_s": -1.0}, "at_s = -1.0: want seconds"),
        ({"at_s": inf}, "at_s = inf"),
        ({"until_s": 3.0}, "until_s = 3.0: want later than at_s = 3"),
        ({"ramp_s": nan}, "ramp_s = nan"),
        ({"axis": 3}, "axis = 3: want one of"),
        ({"failure": "off", "axis": 0}, "axis = 0"),
    ],
)
def test_a_fault_that_cannot_be(fields: dict[str, Any], wanted: str) -> None:
    with pytest.raises(ValueError, match=wanted):
        Fault(**({"subject": Subject(Target.DVL, "dvl"), "failure": "stuck", "at_s": 3.0} | fields))


def test_it_grows_along_its_ramp_and_ends() -> None:
    one = Fault(subject=subject_named("dvl"), failure="stuck", at_s=10.0, until_s=20.0, ramp_s=4.0)
    assert [one.grown(time_s) for time_s in (9.9, 10.0, 11.0, 14.0, 19.9, 20.0)] == [0.0, 0.0, 0.25, 1.0, 1.0, 0.0]
    assert one.active(10.0) and not one.active(20.0)


def test_without_a_ramp_it_is_there_at_once() -> None:
    assert Fault(subject=subject_named("dvl"), failure="stuck", at_s=10.0).grown(10.0) == 1.0


@pytest.mark.parametrize("name", ["can0", "vcan1", "port-can", "CAN_B", "bus2"])
def test_names_of_buses(name: str) -> None:
    assert subject_named(name) == Subject(Target.BUS, name)


@pytest.mark.parametrize(
    "name", ["thruster", "thruster 0", "thruster 100", "T3", "thruster 3 pwm", "dvl2 x", "", "navigator"]
)
def test_names_of_nothing(name: str) -> None:
    with pytest.raises(ValueError, match="no such subject"):
        subject_named(name)


@pytest.mark.parametrize(
    ("quantity", "words"),
    [
        (Quantity("x", ""), ""),
        (Quantity("x", "", None, 0.0, 536870911.0), "at least 0, at most 536870911"),
        (Quantity("x", "", None, 0.0), "at least 0"),
        (Quantity("x", "", None, 0.0, 0.95, inclusive=False), "above 0, at most 0.95"),
    ],
)
def test_bounds_in_words(quantity: Quantity, words: str) -> None:
    assert quantity.wanted == words


@st.composite
def drawn_faults(draw: st.DrawFn) -> Fault:
    row = draw(st.sampled_from(TABLE))
    seconds = st.floats(0.0, 1e4)
    at_s = draw(seconds)
    sizes = {
        one.name: draw(st.floats(max(one.minimum, -1e6), min(one.maximum, 1e6), exclude_min=True))
        for one in row.quantities
    }
    return Fault(
        subject=subject_named(NAMES[row.target]),
        failure=row.failure,
        at_s=at_s,
        until_s=at_s + draw(st.floats(1e-3, 1e4) | st.just(inf)),
        ramp_s=draw(seconds),
        values=sizes,
        axis=draw(st.none() | st.sampled_from(range(3))) if row.axes else None,
    )


@given(drawn_faults())
def test_entries_of_faults_give_them_again(one: Fault) -> None:
    assert faults_of(entries_of([one])) == (one,)


@settings(max_examples=40)
@given(st.lists(drawn_faults(), max_size=2), st.text(max_size=20), st.integers(0, 2**40))
def test_scenarios_dump_and_load(faults: list[Fault], about: str, seed: int) -> None:
    scenario = Scenario(name="n", about=about, seed=seed, duration_s=30_000.0, faults=faults)
    assert parse_scenario(dump_scenario(scenario), Path("/nowhere")) == scenario
