"""From configuration and detectors to the supervisor's terms: who is watched, by which rules, in which words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import assert_never

from detectors.verdict import Level
from gateway import texts
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.observation import Observation
from gateway.sensor_observations import SUBJECTS, navigation_observations
from gateway.silence import SilenceWatch, Watched
from gateway.supervision.debounce import DebounceTimes
from gateway.supervisor import Policy, Supervisor

# of two sensors that it could be, most often one is named within a moment: then the pilot hears of that one only
DOUBT_S = 3.0
# a link that flaps is said to be silent once, and to be back once it stays
SILENCE_OVER_S = 3.0
# MAVLink is lost after four to five of its heartbeats, which may be all that comes
MAVLINK_SILENT_S = 5.0

CONFLICT = "link mavlink autopilots"


def observations(judgement: Judgement) -> Iterator[Observation]:
    """What the supervisor is told of a judgement."""
    match judgement:
        case ThrusterJudgement():
            yield _thruster_observation(judgement)
        case SpeedJudgement():
            yield _speed_observation(judgement)
        case NavigationJudgement():
            yield from navigation_observations(judgement)
        case _:
            assert_never(judgement)


def _thruster_observation(judgement: ThrusterJudgement) -> Observation:
    sample, verdict = judgement.sample, judgement.verdict
    details = texts.thruster_details(sample, verdict)
    if verdict.level is Level.UNKNOWN:
        details = (verdict.reason,) if verdict.reason else ()
    return Observation(
        time_s=verdict.time_s,
        detector="thruster",
        subject=f"thruster {judgement.thruster}",
        label=f"T{judgement.thruster}",
        level=verdict.level,
        score=verdict.score,
        trouble=texts.thruster_trouble(verdict),
        details=details,
    )


def _speed_observation(judgement: SpeedJudgement) -> Observation:
    verdict = judgement.verdict
    return Observation(
        time_s=verdict.time_s,
        detector="speed",
        subject="vehicle",
        label="Speed",
        level=verdict.level,
        score=verdict.score,
        trouble=texts.speed_trouble(verdict),
        details=texts.speed_details(verdict),
    )


def autopilots_observation(time_s: float, system_ids: tuple[int, ...]) -> Observation:
    """Several autopilots on one link, or, with none named, that there is one again."""
    level = Level.SUSPECT if system_ids else Level.NORMAL
    trouble = f"has several autopilots: {', '.join(map(str, system_ids))}"
    return Observation(time_s, "link", CONFLICT, MAVLINK, level, math.nan, trouble)


def supervisor(config: Config) -> Supervisor:
    """The supervisor that the configuration asks for."""
    settings, failsafe = config.supervisor, config.failsafe
    times = DebounceTimes(settings.suspect_after_s, settings.fault_after_s, settings.clear_after_s)
    doubt = DebounceTimes(max(settings.suspect_after_s, DOUBT_S), max(settings.fault_after_s, DOUBT_S), times.clear_s)
    silence = Policy(DebounceTimes(0.0, 0.0, SILENCE_OVER_S))
    policies = {
        "thruster": Policy(times, cleared_by_disarm=True, failsafe=failsafe.thruster_fault),
        "speed": Policy(times, cleared_by_disarm=True, failsafe=failsafe.speed_fault),
        # a sensor that lies still lies after disarming: armed again, it is told again at once
        **dict.fromkeys(SUBJECTS.values(), Policy(times, cleared_by_disarm=True, failsafe=failsafe.navigation_fault)),
        "navigation": Policy(doubt, cleared_by_disarm=True, failsafe=failsafe.navigation_fault),
        "link": silence,
        "signal": silence,
    }
    return Supervisor(policies, failsafe.interval_s, settings.repeat_s)


def silence_watch(config: Config, signals: Iterable[Watched]) -> SilenceWatch:
    """The watch over all links of the configuration, and over what the channels need to hear."""
    silent_s = config.supervisor.silent_s
    limits_s = {link: max(silent_s, MAVLINK_SILENT_S) if link == MAVLINK else silent_s for link in config.links()}
    links = [Watched("link", f"link {link}", link, link, limit_s) for link, limit_s in limits_s.items()]
    return SilenceWatch(links, signals)
