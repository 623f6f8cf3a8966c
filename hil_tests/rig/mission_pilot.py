"""A pilot who drives a scenario's mission: plays around as its style says, and does what its steps want, in time."""

from __future__ import annotations

from collections import deque
from dataclasses import astuple, replace
from math import radians

from hil_tests.rig.commander import Commander
from hil_tests.rig.helm import BLUEROV2, Course, Steering
from hil_tests.rig.pilot import AXES, CRUISING, SURVEYING, WORKING, DrivingStyle, Pilot, Sticks
from hil_tests.rig.steering import Depth, Hand, Held, SpeedAhead
from hil_tests.rig.vehicle import Motion
from hil_tests.scenario.document import Mission, Step

STYLES = {
    "still": DrivingStyle(Sticks(), Sticks()),
    "surveying": SURVEYING,
    "cruising": CRUISING,
    "working": WORKING,
}
# Styles that hold the vehicle down would take it to the bottom of the sea: at the lower end of this band the pilot
# turns the dive into a climb, at the upper into a dive.
BAND_M = 30.0


class MissionPilot:
    """All four sticks, and what else the pilot does.

    Args:
        mission: to be driven.
        seed: of what the hands play.
        helm: how the vehicle is steered.
    """

    def __init__(self, mission: Mission, seed: int, helm: Steering = BLUEROV2) -> None:
        self._playing = Pilot(seed, STYLES[mission.style])
        self._top_m = mission.depth_m
        self._climbing = False
        self._helm = helm
        self._hands: dict[str, Hand] = {}
        self._steps = deque(sorted(mission.steps, key=lambda step: step.at_s))
        self._sticks = Sticks()
        if mission.course is not None:
            course = Course(tuple(map(radians, mission.course.headings_deg)), mission.course.leg_s)
            self._hands["yaw"] = lambda since_s, motion: self._steer(course.heading_rad(since_s), motion)

    def sticks(self, since_s: float, motion: Motion, commander: Commander) -> Sticks:
        """Do what is due, and say where the sticks are then; `since_s` must not go back.

        Raises:
            ValueError: a step asks for a mode that the autopilot does not know.
        """
        while self._steps and since_s >= self._steps[0].at_s:
            self._do(self._steps.popleft(), commander)
        played = self._played(since_s, motion)
        steered = {axis: hand(since_s, motion) for axis, hand in self._hands.items()}
        self._sticks = replace(played, **steered)
        return self._sticks

    def _played(self, since_s: float, motion: Motion) -> Sticks:
        if motion.down_m > self._top_m + BAND_M:
            self._climbing = True
        elif motion.down_m <= self._top_m:
            self._climbing = False
        played = self._playing.sticks(since_s)
        return replace(played, down=-played.down) if self._climbing else played

    def _do(self, step: Step, commander: Commander) -> None:
        if step.mode is not None:
            commander.select(step.mode)
        if step.armed is not None:
            commander.arm(step.armed)
        if step.sticks is not None:
            self._move(step)
        if step.heading_deg is not None:
            wanted_rad = radians(step.heading_deg)
            self._hands["yaw"] = lambda _, motion: self._steer(wanted_rad, motion)
        if step.depth_m is not None:
            self._hands["down"] = Depth(step.depth_m, self._sticks.down)
        if step.speed_mps is not None:
            self._hands["forward"] = SpeedAhead(step.speed_mps, self._sticks.forward)

    def _steer(self, heading_rad: float, motion: Motion) -> float:
        idle = max(abs(self._sticks.forward), abs(self._sticks.right)) < self._helm.dead_band
        return self._helm.stick(heading_rad, motion, idle)

    def _move(self, step: Step) -> None:
        """Sticks that the step names are moved from where they are."""
        for axis, begins_at in zip(AXES, astuple(self._sticks), strict=True):
            leads_to = getattr(step.sticks, axis)
            if leads_to is not None:
                self._hands[axis] = Held(begins_at, leads_to, step.at_s, step.over_s)
