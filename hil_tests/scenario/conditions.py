"""How the vehicle is driven and in what water, or which recording is played in their place.

Times: seconds since the start; bearings: degrees from north.
"""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from hil_tests.scenario.section import Bearing, Seconds, SecondsAbove0, Section, Several, Stick


class Course(Section):
    """Headings that are steered in turn, over and over."""

    headings_deg: Several[Bearing] = Field(min_length=1, description="steered one after the other")
    leg_s: SecondsAbove0 = Field(description="how long each is steered")


class Sticks(Section):
    """The pilot's hands: each -1 to 1; left out: as before."""

    forward: Stick | None = Field(default=None, description="1 is full ahead")
    right: Stick | None = Field(default=None, description="1 is full to the right")
    down: Stick | None = Field(default=None, description="1 is full down")
    yaw: Stick | None = Field(default=None, description="1 is full turn to the right")


class Step(Section):
    """Something that the pilot does at a time."""

    at_s: Seconds = Field(description="when")
    sticks: Sticks | None = Field(
        default=None, description="where they are moved; one that is named here is held from then on"
    )
    over_s: Seconds = Field(default=0.25, description="how long the hands take for it")
    heading_deg: Bearing | None = Field(default=None, description="steered from then on")
    depth_m: float | None = Field(default=None, ge=0.0, le=11_000.0, description="gone to, and kept")
    speed_mps: float | None = Field(
        default=None,
        ge=-30.0,
        le=30.0,
        description="through the water, ahead: the pilot gives as much stick as it takes",
    )
    mode: str | None = Field(default=None, description="asked of the autopilot, in its own words")
    armed: bool | None = Field(default=None, description="the pilot arms or disarms")

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if self.model_fields_set <= {"at_s", "over_s"}:
            raise ValueError("does nothing: want sticks, heading_deg, depth_m, speed_mps, mode or armed")
        return self


class Mission(Section):
    """How the vehicle is driven."""

    style: Literal["still", "surveying", "cruising", "working"] = Field(
        default="surveying", description='what the hands play around; "still" holds the sticks where they are'
    )
    mode: str = Field(default="MANUAL", description="the autopilot's, to begin with, in its own words")
    armed: bool = Field(default=True, description="to begin with")
    depth_m: float = Field(default=5.0, ge=0.0, le=11_000.0, description="to begin with")
    course: Course | None = Field(
        default=None, description="headings that are steered; left out: the yaw stick is one like the others"
    )
    steps: Several[Step] = Field(default=(), description="what else happens, in order of time")


class Current(Section):
    """Water that moves; with `at_s` it sets in then, within `over_s`."""

    speed_mps: float = Field(ge=0.0, le=10.0, description="at last")
    towards_deg: Bearing = Field(default=0.0, description="true bearing that it sets to")
    at_s: Seconds = Field(default=0.0, description="when it begins to set in")
    over_s: Seconds = Field(default=0.0, description="how long it takes to its full speed")


class Tide(Section):
    """A tidal current to and fro along a line: its greatest speed at `phase_deg` 0."""

    speed_mps: float = Field(ge=0.0, le=10.0, description="the greatest")
    towards_deg: Bearing = Field(default=0.0, description="true bearing that the flood sets to")
    period_s: SecondsAbove0 = Field(default=44714.0, description="44714 is the moon's half-daily tide, M2")
    phase_deg: Bearing = Field(default=0.0, description="at the start")


class Shear(Section):
    """A current that changes linearly with depth, from the surface."""

    surface_mps: float = Field(ge=-10.0, le=10.0, description="at the surface")
    per_m_mps: float = Field(ge=-10.0, le=10.0, description="added for each metre of depth")
    towards_deg: Bearing = Field(default=0.0, description="true bearing that it sets to")


class WaterBody(Section):
    """All currents add up; gusts are faults of the subject "water"."""

    currents: Several[Current] = Field(default=(), description="each the same everywhere")
    tide: Tide | None = Field(default=None, description="a tidal current to and fro along a line")
    shear: Shear | None = Field(default=None, description="a current that changes with depth")


class GatewaySection(Section):
    """The gateway under test. Its buses, endpoint and files are replaced by those of the play."""

    config: Annotated[Path, Strict(False)] | None = Field(
        default=None,
        description="its file, relative to the scenario's; left out: the one that the vehicle's profile makes",
    )
    settings: dict[str, Any] = Field(
        default_factory=dict,
        description="tables laid over it, as in its own TOML file: {failsafe: {thruster_fault: hold}}; "
        "null takes a table or a key away: {speed: null}",
    )
    signed: bool = Field(default=False, description="the autopilot and it sign their packets, with a key of the play")


class Recording(Section):
    """A recorded dive instead of a simulated one; faults are laid over it."""

    logs: Several[str] = Field(
        min_length=1, description="any that `gateway replay` reads, relative to this file, each [BUS=]PATH"
    )
    from_s: Seconds = Field(
        default=0.0, description="the part of it that is played begins there, since its own beginning"
    )
    to_s: Annotated[float, Field(gt=0.0, allow_inf_nan=True)] = Field(default=inf, description="and ends there")

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not self.from_s < self.to_s:
            raise ValueError(f"nothing is played: want from_s = {self.from_s:g} before to_s = {self.to_s:g}")
        return self
