"""Outcomes made by hand, of a play that began at `START_S`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.severity import Severity
from hil_tests.report.outcome import ModeChange, Outcome
from hil_tests.rig.commands import Command, Result
from hil_tests.rig.notes import ReceivedCommand, ReceivedText
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.expectations import Expectation, Prohibition
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault, Subject

START_S = 1_790_000_000.0
ENTANGLED_S = 25.0
SEVERITIES = {
    Level.UNKNOWN: Severity.INFO,
    Level.NORMAL: Severity.NOTICE,
    Level.SUSPECT: Severity.WARNING,
    Level.FAULT: Severity.CRITICAL,
}

ENTANGLED = Fault(
    subject=Subject(Target.THRUSTER, "thruster 3", thruster=3),
    failure="entangled",
    at_s=ENTANGLED_S,
    until_s=50.0,
    ramp_s=4.0,
    values={"share": 0.3},
)


def finding(
    since_s: float,
    level: Level = Level.FAULT,
    subject: str = "thruster 3",
    text: str = "",
    detector: str = "thruster",
) -> Finding:
    """A finding; its text is of its subject and level unless given."""
    said = text or f"{subject} {level.name}"
    return Finding(START_S + since_s, detector, subject, level, 1.2, said, SEVERITIES[level])


def text(since_s: float, said: str, severity: Severity = Severity.CRITICAL) -> ReceivedText:
    """A STATUSTEXT of the gateway."""
    return ReceivedText(START_S + since_s, 192, severity, said)


def command(
    since_s: float, number: int, *parameters: float, result: Result | None = Result.ACCEPTED
) -> ReceivedCommand:
    """A COMMAND_LONG of the gateway."""
    return ReceivedCommand(START_S + since_s, 192, number, (*parameters, *[0.0] * (7 - len(parameters))), result)


def mode_command(since_s: float, mode: int, result: Result | None = Result.ACCEPTED) -> ReceivedCommand:
    """MAV_CMD_DO_SET_MODE."""
    return command(since_s, Command.DO_SET_MODE, 1.0, float(mode), result=result)


def mode(since_s: float, name: str, armed: bool = True) -> ModeChange:
    """From then on."""
    return ModeChange(START_S + since_s, name, armed)


def play(
    *,
    expect: tuple[Mapping[str, Any], ...] = (),
    never: tuple[Mapping[str, Any], ...] = (),
    faults: tuple[Fault, ...] = (ENTANGLED,),
    path: Path = Path("scenarios/weeds.yaml"),
    lasted_s: float = 60.0,
    **came: Any,
) -> Outcome:
    """An outcome of a scenario with these expectations, as a file would have them; `came` are fields of it."""
    scenario = Scenario(
        name="weeds on a horizontal thruster",
        duration_s=lasted_s,
        faults=faults,
        expect=tuple(Expectation.model_validate(one) for one in expect),
        never=tuple(Prohibition.model_validate(one) for one in never),
    )
    fields = {"way": "virtual time", "wall_s": 1.5} | came
    return Outcome(scenario=scenario, path=path, start_s=START_S, end_s=START_S + lasted_s, **fields)
