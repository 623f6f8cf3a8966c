"""The scenario itself: what the file says, checked. Times: seconds since the start; bearings: degrees from north."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field, InstanceOf, PlainSerializer

from hil_tests.scenario.conditions import (
    Course,
    Current,
    GatewaySection,
    Mission,
    Recording,
    Shear,
    Step,
    Sticks,
    Tide,
    WaterBody,
)
from hil_tests.scenario.entry import entries_of, faults_of
from hil_tests.scenario.expectations import Expectation, FindingPattern, Prohibition
from hil_tests.scenario.fault import Fault
from hil_tests.scenario.section import Section, Several

__all__ = [
    "Course",
    "Current",
    "Expectation",
    "FindingPattern",
    "GatewaySection",
    "Mission",
    "Prohibition",
    "Recording",
    "Scenario",
    "Section",
    "Shear",
    "Step",
    "Sticks",
    "Tide",
    "WaterBody",
]

Faults = Annotated[
    tuple[InstanceOf[Fault], ...],
    BeforeValidator(faults_of),
    PlainSerializer(entries_of),
]


class Scenario(Section):
    """A whole file. In Python, faults may be written as in the file as well:

    Scenario(duration_s=60, faults=[{"at_s": 25, "subject": "thruster 3", "failure": "entangled"}])
    """

    name: str = Field(default="", description="what it is called; left out: the file's name")
    about: str = Field(default="", description="what it shows, and why")
    tags: Several[str] = Field(
        default=(),
        description="to choose by: vcan: also played in real time on a real bus; healthy: nothing is wrong",
    )
    source: str = Field(default="", description="row of a table or section of a paper that it is of")
    vehicle: str = Field(default="bluerov2_heavy", min_length=1, description="name of a profile, or path of your own")
    seed: int = Field(default=0, ge=0, description="of all chance")
    duration_s: float = Field(gt=0.0, le=36_000.0, description="of the play")
    mission: Mission = Field(default=Mission(), description="how the vehicle is driven")
    water: WaterBody = Field(default=WaterBody(), description="what it is driven in")
    recording: Recording | None = Field(
        default=None, description="a recorded dive instead of vehicle, mission and water"
    )
    gateway: GatewaySection = Field(default=GatewaySection(), description="the gateway under test")
    faults: Faults = Field(default=(), description="what goes wrong, and when")
    expect: Several[Expectation] = Field(default=(), description="what must come about")
    never: Several[Prohibition] = Field(default=(), description="what must not happen")

    @property
    def first_fault_s(self) -> float:
        """Onset of the first fault; 0 where there is none."""
        return min((fault.at_s for fault in self.faults), default=0.0)
