"""The scenario itself: what the file says, checked. Times: seconds since the start; bearings: degrees from north."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from hil_tests.scenario.fault import Fault

Seconds = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Stick = Annotated[float, Field(ge=-1.0, le=1.0)]


class Section(BaseModel):
    """A part of a scenario: no keys but its own, no changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Course(Section):
    """Headings that are steered in turn, over and over."""

    headings_deg: tuple[float, ...] = Field(min_length=1)
    leg_s: float = Field(gt=0.0)


class Sticks(Section):
    """The pilot's hands: each -1 to 1; left out: as before."""

    forward: Stick | None = None
    right: Stick | None = None
    down: Stick | None = None
    yaw: Stick | None = None


class Step(Section):
    """Something that the pilot does at a time.

    Attributes:
        at_s: when.
        sticks: where they are moved, within `over_s`; a stick that is named here is held from then on.
        heading_deg: steered from then on.
        depth_m: gone to, and kept.
        speed_mps: through the water, ahead: the pilot gives as much stick as it takes.
        mode: asked of the autopilot, in its own words.
        armed: the pilot arms or disarms.
    """

    at_s: Seconds
    sticks: Sticks | None = None
    over_s: Seconds = 0.25
    heading_deg: float | None = None
    depth_m: float | None = Field(default=None, ge=0.0)
    speed_mps: float | None = None
    mode: str | None = None
    armed: bool | None = None


class Mission(Section):
    """How the vehicle is driven.

    Attributes:
        style: what the hands play around: "still" holds the sticks where they are.
        mode, armed: to begin with.
        depth_m: to begin with.
        course: headings that are steered; left out: the yaw stick is one like the others.
        steps: what else happens, in order of time.
    """

    style: Literal["still", "surveying", "cruising", "working"] = "surveying"
    mode: str = "MANUAL"
    armed: bool = True
    depth_m: float = Field(default=5.0, ge=0.0)
    course: Course | None = None
    steps: tuple[Step, ...] = ()


class Current(Section):
    """Water that moves; with `at_s` it sets in then, within `over_s`."""

    speed_mps: float = Field(ge=0.0)
    towards_deg: float = 0.0
    at_s: Seconds = 0.0
    over_s: Seconds = 0.0


class Tide(Section):
    """A tidal current to and fro along a line: its greatest speed at `phase_deg` 0."""

    speed_mps: float = Field(ge=0.0)
    towards_deg: float = 0.0
    period_s: float = Field(default=44714.0, gt=0.0)
    phase_deg: float = 0.0


class Shear(Section):
    """A current that changes linearly with depth, from the surface."""

    surface_mps: float
    per_m_mps: float
    towards_deg: float = 0.0


class WaterBody(Section):
    """All currents add up; gusts are faults of the subject "water"."""

    currents: tuple[Current, ...] = ()
    tide: Tide | None = None
    shear: Shear | None = None


class GatewaySection(Section):
    """The gateway under test.

    Attributes:
        config: its file, relative to the scenario's; None: the one that the vehicle's profile makes. Buses, endpoint
            and files are replaced by those of the play.
        settings: tables laid over it, as in its own TOML file: {"failsafe": {"thruster_fault": "hold"}}.
    """

    config: Path | None = None
    settings: dict[str, Any] = Field(default_factory=dict)


class Recording(Section):
    """A recorded dive instead of a simulated one; faults are laid over it.

    Attributes:
        logs: any that `gateway replay` reads, relative to the scenario's file, each `[BUS=]PATH`.
        from_s, to_s: the part of it that is played, since its beginning.
    """

    logs: tuple[str, ...] = Field(min_length=1)
    from_s: Seconds = 0.0
    to_s: float = inf


class FindingPattern(Section):
    """A finding; what is left out may be anything.

    Attributes:
        subject: "thruster 3", "vehicle", "dvl", "link can0", ...; `*` stands for any letters.
        level: this one exactly.
        at_least: this one or worse.
        text: a regular expression that is found in its text.
    """

    subject: str = "*"
    level: Literal["UNKNOWN", "NORMAL", "SUSPECT", "FAULT"] | None = None
    at_least: Literal["SUSPECT", "FAULT"] | None = None
    text: str | None = None


class Expectation(Section):
    """What must come about: exactly one of `finding`, `statustext`, `command`, `mode`.

    Attributes:
        finding: of the gateway.
        statustext: a regular expression that is found in a text that reached the autopilot.
        severity: of that text, at least: "CRITICAL", "ERROR", "WARNING", ...
        command: that reached the autopilot: "hold", "surface", "manual", "disarm", "terminate".
        mode: the autopilot's, in its own words, or a list of which any will do.
        after_s: from when on it counts; left out: the onset of the first fault, 0 where there is none.
        within_s: so long after `after_s` at most; of a mode that is left out: at the end of the scenario.
        not_before_s: earlier than that, since `after_s`, is wrong as well.
    """

    finding: FindingPattern | None = None
    statustext: str | None = None
    severity: Literal["EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING", "NOTICE", "INFO"] | None = None
    command: str | None = None
    mode: str | tuple[str, ...] | None = None
    after_s: float | None = Field(default=None, ge=0.0)
    within_s: float | None = Field(default=None, gt=0.0)
    not_before_s: Seconds = 0.0


class Prohibition(Section):
    """What must not happen: exactly one of `finding`, `statustext`, `command`, between two times.

    Attributes:
        finding, statustext, command: as of an expectation; `command: "*"`: any that acts on the vehicle.
        from_s, before_s: when; left out: from the start, to the end. `before_s: fault` is the first fault's onset.
    """

    finding: FindingPattern | None = None
    statustext: str | None = None
    command: str | None = None
    from_s: Seconds = 0.0
    before_s: float | Literal["fault"] | None = None


class Scenario(Section):
    """A whole file.

    Attributes:
        name: what it is called; left out: the file's name.
        about: what it shows, and why.
        tags: to choose by: "vcan" are those that CI also plays in real time on a real bus, "healthy" have no fault.
        source: row of a table or section of a paper that it is of.
        vehicle: name of a profile, or path of one's own, relative to this file.
        seed: of all chance.
        duration_s: of the play.
        mission, water: how it is driven, and in what.
        recording: a recorded dive instead of vehicle, mission and water.
        gateway: under test.
        faults: on the time line, in order of onset.
        expect: what must come about.
        never: what must not happen.
    """

    name: str = ""
    about: str = ""
    tags: tuple[str, ...] = ()
    source: str = ""
    vehicle: str = "bluerov2_heavy"
    seed: int = Field(default=0, ge=0)
    duration_s: float = Field(gt=0.0, le=36_000.0)
    mission: Mission = Mission()
    water: WaterBody = WaterBody()
    recording: Recording | None = None
    gateway: GatewaySection = GatewaySection()
    faults: tuple[Fault, ...] = ()
    expect: tuple[Expectation, ...] = ()
    never: tuple[Prohibition, ...] = ()

    @property
    def first_fault_s(self) -> float:
        """Onset of the first fault; 0 where there is none."""
        return min((fault.at_s for fault in self.faults), default=0.0)
