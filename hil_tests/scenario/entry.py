"""A fault as the scenario file writes it: flat, its quantities beside its times; one entry may befall several.

{at_s: 25, subject: [thruster 1, thruster 3], failure: entangled, share: 0.25, ramp_s: 1, duration_s: 10}
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from math import inf, nextafter
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, ValidationError, create_model
from pydantic_core import InitErrorDetails, PydanticCustomError

from gateway.problems import problem_in
from hil_tests.scenario.failures import FailureKind, Quantity, Target, kinds_of
from hil_tests.scenario.fault import Fault, Subject, failure_hint, subject_named
from hil_tests.scenario.section import Seconds, SecondsAbove0, Section, Several

EntryT = TypeVar("EntryT", bound=Section)

Names = str | Annotated[Several[str], Field(min_length=1)]


class What(Section):
    """Which row of the table an entry is of."""

    subject: Names = Field(description="whom it befalls; a list: each of them")
    failure: str = Field(description="what happens")


class Beginning(What):
    """What all entries have."""

    at_s: Seconds = Field(description="onset")
    duration_s: SecondsAbove0 | None = Field(default=None, description="how long it lasts; left out: to the end")
    ramp_s: Seconds = Field(default=0.0, description="how long it takes to its full size; 0: at once")


@cache
def entry_model(row: FailureKind) -> type[Beginning]:
    """The model of entries of a row of the table: with its quantities as keys of their own."""
    keys: dict[str, Any] = {quantity.name: (float, _field(quantity)) for quantity in row.quantities}
    if row.axes:
        axis: Any = Literal[row.axes]
        keys["axis"] = (axis | None, Field(default=None, description="which component; left out: all"))
    return create_model(f"{row.target}_{row.failure}", __base__=Beginning, __doc__=row.text, **keys)


def _field(quantity: Quantity) -> Any:
    bounds: dict[str, Any] = {"ge" if quantity.inclusive else "gt": quantity.minimum, "le": quantity.maximum}
    bounds |= {"default": quantity.default} if quantity.default is not None else {}
    return Field(description=quantity.text, allow_inf_nan=False, **bounds)


def faults_of(entries: object) -> object:
    """The faults of a list of entries; a `Fault` among them stays what it is.

    Raises:
        ValidationError: with all that is wrong with any of them.
        ValueError: it is no list.
    """
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise ValueError("should be a list of faults, each with at_s, subject and failure")
    problems: list[InitErrorDetails] = []
    faults: list[Fault] = []
    for place, entry in enumerate(entries):
        try:
            faults += [entry] if isinstance(entry, Fault) else _faults_of(entry)
        except ValidationError as error:
            problems += [_within(place, item) for item in error.errors(include_url=False)]
    if problems:
        raise ValidationError.from_exception_data("faults", problems)
    return tuple(faults)


def entries_of(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Entries that give these faults again, one each."""
    return [_entry_of(fault) for fault in faults]


def names_in(entry: Mapping[str, Any]) -> list[str]:
    """The subjects of an entry."""
    named = entry["subject"]
    return [named] if isinstance(named, str) else list(named)


def _faults_of(entry: Any) -> list[Fault]:
    """Raises ValidationError with places within the entry."""
    if not isinstance(entry, Mapping):
        raise _wrong([((), entry, "should be a table with at_s, subject and failure")])
    _validated(What, {key: value for key, value in entry.items() if key in What.model_fields})
    subjects = _subjects(entry)
    rows = {subject.target: _row(subject.target, entry["failure"]) for subject in subjects}
    checked = {target: _validated(entry_model(row), entry) for target, row in rows.items()}
    return [_fault(subject, rows[subject.target], checked[subject.target]) for subject in subjects]


def _validated(model: type[EntryT], entry: Mapping[str, Any]) -> EntryT:
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        raise _wrong([_problem(item, model) for item in error.errors(include_url=False)]) from error


def _problem(item: Any, model: type[Section]) -> tuple[tuple[str | int, ...], object, str]:
    problem = problem_in(item, model, ".".join(map(str, item["loc"])))
    return item["loc"], problem.value, problem.wanted


def _subjects(entry: Mapping[str, Any]) -> list[Subject]:
    alone = isinstance(entry["subject"], str)
    subjects, problems = [], []
    for place, name in enumerate(names_in(entry)):
        try:
            subjects.append(subject_named(name))
        except ValueError as error:
            problems.append((("subject",) if alone else ("subject", place), name, str(error)))
    if problems:
        raise _wrong(problems)
    return subjects


def _row(target: Target, failure: str) -> FailureKind:
    row = kinds_of(target).get(failure)
    if row is None:
        raise _wrong([(("failure",), failure, failure_hint(target, failure))])
    return row


def _fault(subject: Subject, row: FailureKind, entry: Beginning) -> Fault:
    axis = getattr(entry, "axis", None)
    return Fault(
        subject=subject,
        failure=row.failure,
        at_s=entry.at_s,
        until_s=inf if entry.duration_s is None else entry.at_s + entry.duration_s,
        ramp_s=entry.ramp_s,
        values={quantity.name: getattr(entry, quantity.name) for quantity in row.quantities},
        axis=None if axis is None else row.axes.index(axis),
    )


def _entry_of(fault: Fault) -> dict[str, Any]:
    entry: dict[str, Any] = {"at_s": fault.at_s, "subject": fault.subject.name, "failure": fault.failure}
    quantities = fault.kind.quantities
    entry |= {one.name: fault.values[one.name] for one in quantities if fault.values[one.name] != one.default}
    entry |= {"axis": fault.kind.axes[fault.axis]} if fault.axis is not None else {}
    entry |= {"ramp_s": fault.ramp_s} if fault.ramp_s else {}
    return entry | ({"duration_s": _duration_s(fault)} if fault.until_s < inf else {})


def _duration_s(fault: Fault) -> float:
    """What, added to the onset, gives the end again, bit for bit; the shortest to read that does."""
    length_s = fault.until_s - fault.at_s
    tried = (round(length_s, 6), length_s, nextafter(length_s, 0.0), nextafter(length_s, inf))
    return next((one for one in tried if fault.at_s + one == fault.until_s), length_s)


def _wrong(problems: Iterable[tuple[tuple[str | int, ...], object, str]]) -> ValidationError:
    """An error with all problems: place within the entry, what is there, what would be right."""
    return ValidationError.from_exception_data("fault", [_detail(*problem) for problem in problems])


def _within(place: int, item: Any) -> InitErrorDetails:
    return _detail((place, *item["loc"]), item["input"], item["msg"])


def _detail(location: tuple[str | int, ...], value: object, wanted: str) -> InitErrorDetails:
    error = PydanticCustomError("fault", "{wanted}", {"wanted": wanted})
    return InitErrorDetails(type=error, loc=location, input=value)
