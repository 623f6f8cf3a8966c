"""The course of a dive, collected while its logs are replayed: an onlooker of the replay.

Memory is bounded, however long the dive: see `gateway.report.thinning`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from math import nan

from drivers.readings import AutopilotHeartbeat
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement
from gateway.config import Config
from gateway.findings import Finding
from gateway.navigation_channel import SUBJECT as NAVIGATION
from gateway.pipeline import Pipeline
from gateway.replay.result import ReplayResult
from gateway.report.dive import Dive, LinkCourse
from gateway.report.link_collecting import LinkCollecting
from gateway.report.navigation_collecting import NavigationCollecting
from gateway.report.speed_collecting import SpeedCollecting
from gateway.report.thruster_collecting import ThrusterCollecting
from gateway.report.vehicle_collecting import VehicleCollecting
from gateway.report.versions import versions
from gateway.sensor_observations import SUBJECTS
from gateway.severity import Severity
from gateway.speed_channel import SUBJECT as VEHICLE
from gateway.stretches.stretch import BlockArrival
from gateway.thruster_channel import JudgedColumns, ThrusterCurves

NO_CURVES = ThrusterCurves(None, None)


class Collecting:
    """See the module's text; an `Onlooker` of `gateway.replay.session.replay`.

    Args:
        config: that the dive is judged by.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._thrusters = {one.number: ThrusterCollecting(one) for one in config.thruster}
        self._speed = SpeedCollecting()
        self._navigation = NavigationCollecting()
        self._links = {name: LinkCollecting(name, config.supervisor.silent_s) for name in config.links()}
        self._vehicle = VehicleCollecting()
        self._curves: dict[int, ThrusterCurves] = {}

    def stretch(self, arrivals: Sequence[BlockArrival]) -> None:
        """These readings come next."""
        for arrival in arrivals:
            link = self._links.get(arrival.link)
            if link is not None:
                link.take(arrival.readings)
            for _, reading in arrival.readings.others:
                if isinstance(reading, AutopilotHeartbeat):
                    self._vehicle.take(reading)

    def seen(self, shown: JudgedColumns | Judgement) -> None:
        """What the detectors say."""
        if isinstance(shown, JudgedColumns):
            self._thrusters[shown.thruster].take_columns(shown)
        elif isinstance(shown, NavigationJudgement):
            self._navigation.take(shown)
        elif isinstance(shown, SpeedJudgement):
            self._speed.take(shown)
        else:
            self._thrusters[shown.thruster].take(shown)

    def end(self, pipeline: Pipeline) -> None:
        """What was learnt, at the end; of a run after another one, what is not known is that of the one before."""
        for number, curves in pipeline.curves().items():
            before = self._curves.get(number, NO_CURVES)
            self._curves[number] = ThrusterCurves(
                curves.learnt or before.learnt, curves.commissioned or before.commissioned
            )

    def dive(self, result: ReplayResult, findings: Sequence[Finding], logs: Sequence[str]) -> Dive:
        """All that was collected.

        Args:
            result: what the replay came to.
            findings: that it has found, in order.
            logs: names of the files.
        """
        begin_s = result.begin_s or 0.0
        end_s = begin_s if result.end_s is None else result.end_s
        courses = (
            one.course(begin_s, self._curves.get(number, NO_CURVES)) for number, one in self._thrusters.items()
        )
        return Dive(
            config=self._config,
            config_text=self._config.text,
            result=result,
            begin_s=begin_s,
            end_s=end_s,
            findings=(*_before(result), *findings),
            logs=tuple(logs),
            versions=versions(),
            thrusters=tuple(one for one in courses if len(one.time_s)),
            speed=self._speed.course(begin_s),
            navigation=self._navigation.course(begin_s),
            links=self._link_courses(begin_s, end_s),
            armed=self._vehicle.armed(begin_s),
            modes=self._vehicle.modes(begin_s),
            from_s=(result.told_from_s or begin_s) - begin_s,
        )

    def _link_courses(self, begin_s: float, end_s: float) -> tuple[LinkCourse, ...]:
        heard = {name: link.seconds()[0] for name, link in self._links.items()}
        courses = (
            link.course(begin_s, end_s, [seconds for other, seconds in heard.items() if other != name])
            for name, link in self._links.items()
        )
        return tuple(course for course in courses if course is not None)


def _before(result: ReplayResult) -> Iterator[Finding]:
    """How the subjects were already when it was told for the first time of a dive that is told in part."""
    if result.told_from_s is None:
        return
    for subject, level in result.levels_before.items():
        text = f"{subject} {level.name} since before"
        yield Finding(result.told_from_s, _detector(subject), subject, level, nan, text, Severity.INFO)


def _detector(subject: str) -> str:
    """Whose findings are of it."""
    if re.fullmatch(r"thruster \d+", subject):
        return "thruster"
    if subject == VEHICLE:
        return "speed"
    return "navigation" if subject in (NAVIGATION, *SUBJECTS.values()) else "signal"
