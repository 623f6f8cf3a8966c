"""The scenario that `gateway hil new` begins with: commented, valid, and ready to be played."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from hil_tests.scenario.failures import FailureKind, Quantity, Target, kinds_of
from hil_tests.scenario.fault import Subject, failure_hint, subject_named
from hil_tests.scenario.schema import SCHEMA_FILE

ONSET_S, DURATION_S, AFTERMATH_S = 60, 90, 30
# What the detectors of navigation sensors take; the others are quicker.
WITHIN_S: Mapping[Target, int] = {Target.THRUSTER: 5, Target.RPM: 5, Target.COMMAND: 5}
SLOW_WITHIN_S = 20
# Whom the gateway blames; what is not here has findings of its own, or none.
BLAMED: Mapping[Target, str] = {
    Target.THRUSTER: "thruster {number}",
    Target.RPM: "thruster {number}",
    Target.COMMAND: "thruster {number}",
    Target.DVL: "dvl",
    Target.DEPTH: "depth sensor",
    Target.ACCELEROMETER: "accelerometer",
    Target.GYROSCOPE: "gyroscope",
}
# Where the table of failures has no default: sizes that are seen, and do happen.
TYPICAL: Mapping[str, float] = {
    "share": 0.25, "factor": 1.3, "interval_s": 1.0, "delay_s": 0.5, "node": 11,
    "spread_rpm": 300, "bias_rpm": 200, "drift_rpm_per_s": 20, "noise_rpm": 150,
    "spread_share": 0.3, "bias_share": 0.2, "drift_share_per_s": 0.02, "noise_share": 0.1,
    "spread_mps": 0.5, "bias_mps": 0.3, "drift_mps2": 0.02, "noise_mps": 0.2,
    "spread_m": 3, "bias_m": 3, "drift_mps": 0.2, "noise_m": 1,
    "spread_mps2": 1, "bias_mps2": 0.5, "drift_mps3": 0.02, "noise_mps2": 0.5,
    "spread_radps": 0.2, "bias_radps": 0.05, "drift_radps2": 0.002, "noise_radps": 0.1,
    "spread_deg": 30, "bias_deg": 20, "drift_degps": 1, "noise_deg": 10,
    "sag_v": 2, "force_n": 30, "speed_mps": 0.4,
}  # fmt: skip

PLAIN = re.compile("[A-Za-z_./][A-Za-z0-9_./-]*")  # needs no quotes in YAML

_TEXT = """\
# yaml-language-server: $schema={schema}
# Times are in seconds since the start. What else can go wrong: gateway hil list --failures
about: >
  What this shows, and why.
tags: []
vehicle: {vehicle}  # or the path of your own: gateway hil list --profiles
seed: 1  # of all chance: the same seed gives the same play
duration_s: {duration_s}

mission:
  style: surveying  # what the pilot's hands do; still: nothing
  mode: MANUAL
  depth_m: 5
  course: {{headings_deg: [0, 90, 180, 270], leg_s: 15}}
  steps: []  # - {{at_s: 30, depth_m: 8}}

water:
  currents: []  # - {{speed_mps: 0.2, towards_deg: 90}}

{faults}
{expect}
never:
  # nothing is said before anything is wrong
  - finding: {{at_least: SUSPECT}}{before}
"""


@dataclass(frozen=True, slots=True)
class WantedFault:
    """What the user has asked for: whom it befalls, what happens, and keys of its entry as the file has them."""

    subject: Subject
    row: FailureKind
    keys: Mapping[str, str]

    def entry(self) -> str:
        """Of the file. Keys that it cannot have are in it as well: the check of the file says so."""
        left = dict(self.keys)
        lines = [f"  - at_s: {left.pop('at_s', ONSET_S)}", f"    subject: {self.subject.name}"]
        lines.append(f"    failure: {self.row.failure}  # {self.row.text}")
        lines += [_quantity(quantity, left.pop(quantity.name, "")) for quantity in self.row.quantities]
        lines += [f"    {key}: {value}" for key, value in left.items()]
        hints = {"axis": f"{self.row.axes[0]}  # {', '.join(self.row.axes)}; left out: all"} if self.row.axes else {}
        hints |= {"ramp_s": "5  # to its full size; left out: at once", "duration_s": "20"}
        return "\n".join([*lines, *(f"    # {key}: {hint}" for key, hint in hints.items() if key not in left)])

    def end_s(self) -> float:
        """When enough was seen of it."""
        with suppress(ValueError):  # what is no number the check tells
            return float(self.keys.get("at_s", ONSET_S)) + AFTERMATH_S
        return DURATION_S


def new_scenario(vehicle: str, faults: Sequence[str], schema: str = SCHEMA_FILE.as_uri()) -> str:
    """The text of a file.

    Args:
        vehicle: name of a profile, or path.
        faults: each a subject and its failure, in words: "thruster 3 entangled", "can0 bus off"; with any keys of its
            entry: "thruster 3 rpm scale factor=0.9 at_s=20".
        schema: what the editor is told of where the schema is.

    Raises:
        ValueError: a fault that is not in the table.
    """
    wanted = [_wanted(fault) for fault in faults]
    return _TEXT.format(
        schema=schema,
        vehicle=vehicle if PLAIN.fullmatch(vehicle) else json.dumps(vehicle),
        duration_s=f"{max([DURATION_S, *(one.end_s() for one in wanted)]):g}",
        faults="\n".join(["faults:" if wanted else "faults: []", *(one.entry() for one in wanted)]) + "\n",
        expect=_expectations([one.subject for one in wanted]),
        before="\n    before_s: fault" if wanted else "",
    )


def _wanted(fault: str) -> WantedFault:
    words = fault.split()
    subject, row = _named(" ".join(word for word in words if "=" not in word))
    keys = dict(word.split("=", 1) for word in words if "=" in word)
    return WantedFault(subject, row, keys)


def _named(fault: str) -> tuple[Subject, FailureKind]:
    """The subject of a fault, which may be of several words, as its failure may be."""
    words = fault.split()
    problems = [f"fault = {fault}: want a subject and what befalls it, such as thruster 3 entangled"]
    for count in range(len(words) - 1, 0, -1):
        try:
            subject = subject_named(" ".join(words[:count]))
        except ValueError as error:
            problems.append(f"fault = {fault}: {error}")
            continue
        row = kinds_of(subject.target).get("_".join(words[count:]))
        if row is not None:
            return subject, row
        raise ValueError(f"fault = {fault}: {failure_hint(subject.target, '_'.join(words[count:]))}")
    raise ValueError(_lacking(fault) or problems[-1])


def _lacking(fault: str) -> str:
    """What to say of a subject that nothing befalls."""
    try:
        subject = subject_named(fault)
    except ValueError:
        return ""
    if subject.target is Target.BUS:  # any word could be one
        return ""
    return f"fault = {fault}: say what befalls it as well: {', '.join(kinds_of(subject.target))}"


def _quantity(quantity: Quantity, given: str) -> str:
    value = TYPICAL[quantity.name] if quantity.default is None else quantity.default
    return f"    {quantity.name}: {given or f'{value:g}'}  # {quantity.text}"


def _expectations(subjects: Sequence[Subject]) -> str:
    lines = []
    for subject in dict.fromkeys(subjects):
        blamed = BLAMED.get(subject.target, "").format(number=subject.thruster)
        if blamed:
            within_s = WITHIN_S.get(subject.target, SLOW_WITHIN_S)
            lines += [f"  - finding: {{subject: {blamed}, level: FAULT}}", f"    within_s: {within_s}"]
    lines = lines or ["  # - finding: {subject: thruster 3, level: FAULT}", "  #   within_s: 5"]
    return (
        "\n".join(["expect:", *lines, '  # - statustext: "^T3 "  # a regular expression', "  #   within_s: 5"]) + "\n"
    )
