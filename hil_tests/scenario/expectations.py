"""What must come about, and what must not. Times: seconds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Self

from pydantic import Field, model_validator

from gateway.supervision.actions import Action, sends
from hil_tests.scenario.finding_subjects import SubjectPattern
from hil_tests.scenario.section import Pattern, Seconds, SecondsAbove0, Section, Several

# what the failsafe can ask of an autopilot
COMMANDS: tuple[str, ...] = tuple(str(action) for action in Action if sends(action))
ANY_COMMAND = "*"
# of which an entry has exactly one
EXPECTED = ("finding", "statustext", "command", "mode")
FORBIDDEN = ("finding", "statustext", "command")


class FindingPattern(Section):
    """A finding; what is left out may be anything."""

    subject: SubjectPattern = Field(
        default="*", description='"thruster 3", "vehicle", "dvl", "link can0"...; `*` stands for any letters'
    )
    besides: SubjectPattern | None = Field(
        default=None, description='but for these: {subject: "thruster *", besides: "thruster 3*"}'
    )
    level: Literal["UNKNOWN", "NORMAL", "SUSPECT", "FAULT"] | None = Field(
        default=None, description="this one exactly"
    )
    at_least: Literal["SUSPECT", "FAULT"] | None = Field(default=None, description="this level or worse")
    text: Pattern | None = Field(default=None, description="a regular expression that is found in its text")

    @model_validator(mode="after")
    def _one_level(self) -> Self:
        if self.level is not None and self.at_least is not None:
            raise ValueError("level and at_least exclude each other: want one of them")
        return self


class Expectation(Section):
    """What must come about: exactly one of `finding`, `statustext`, `command`, `mode`."""

    finding: FindingPattern | None = Field(default=None, description="of the gateway")
    statustext: Pattern | None = Field(
        default=None, description="a regular expression that is found in a text that reached the autopilot"
    )
    severity: Literal["EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING", "NOTICE", "INFO"] | None = Field(
        default=None, description="of that text, at least"
    )
    command: str | None = Field(
        default=None,
        description=f"that reached the autopilot: {', '.join(COMMANDS)}",
        json_schema_extra={"enum": [*COMMANDS]},
    )
    mode: str | Several[str] | None = Field(
        default=None, description="the autopilot's, in its own words, or a list of which any will do"
    )
    after_s: Seconds | None = Field(
        default=None,
        description="from when on it counts; left out: the onset of the first fault, 0 where there is none",
    )
    within_s: SecondsAbove0 | None = Field(
        default=None,
        description="so long after after_s at most; of a mode that is left out: at the end of the scenario",
    )
    not_before_s: Seconds = Field(default=0.0, description="earlier than that, since after_s, is wrong as well")

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        _exactly_one(self, EXPECTED)
        _known_command(self.command, COMMANDS)
        if self.severity is not None and self.statustext is None:
            raise ValueError("severity goes with statustext: want a regular expression for the text")
        if self.within_s is not None and self.not_before_s >= self.within_s:
            raise ValueError(f"can never come: want not_before_s below within_s = {self.within_s:g}")
        return self


class Prohibition(Section):
    """What must not happen: exactly one of `finding`, `statustext`, `command`, between two times."""

    finding: FindingPattern | None = Field(default=None, description="of the gateway")
    statustext: Pattern | None = Field(
        default=None, description="a regular expression that is found in a text that reached the autopilot"
    )
    command: str | None = Field(
        default=None,
        description=f'that reached the autopilot: {", ".join(COMMANDS)}; "*": any that acts on the vehicle',
        json_schema_extra={"enum": [*COMMANDS, ANY_COMMAND]},
    )
    from_s: Seconds = Field(default=0.0, description="from when on")
    before_s: SecondsAbove0 | Literal["fault"] | None = Field(
        default=None, description="until when; left out: to the end; fault: the onset of the first one"
    )

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        _exactly_one(self, FORBIDDEN)
        _known_command(self.command, (*COMMANDS, ANY_COMMAND))
        if isinstance(self.before_s, float) and self.from_s >= self.before_s:
            raise ValueError(f"forbids nothing: want from_s before before_s = {self.before_s:g}")
        return self


def _exactly_one(section: Section, kinds: Sequence[str]) -> None:
    given = [kind for kind in kinds if getattr(section, kind) is not None]
    if len(given) != 1:
        raise ValueError(f"want exactly one of {', '.join(kinds)}, got {' and '.join(given) or 'none'}")


def _known_command(command: str | None, known: Sequence[str]) -> None:
    if command is not None and command not in known:
        raise ValueError(f"command = {command}: no action of the failsafe, want one of {', '.join(known)}")
