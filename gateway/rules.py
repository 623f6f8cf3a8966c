"""From configuration and detectors to the supervisor's terms: who is watched, by which rules, in which words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from math import hypot
from typing import assert_never

from detectors.speed import SpeedVerdict
from detectors.verdict import Level
from gateway import texts
from gateway.channel import Judgement, NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.config import Config
from gateway.config_sections import MAVLINK, Clear, Thruster, Times
from gateway.config_sections import Supervisor as SupervisorTable
from gateway.load_observations import GATEWAY
from gateway.observation import Observation
from gateway.sensor_observations import SUBJECTS, navigation_observations
from gateway.silence import AUTOPILOT, SilenceWatch, Watched
from gateway.supervision.announcements import RateLimit
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.evidence import Geometry
from gateway.supervision.levels import Event
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Supervisor

# of two sensors that it could be, most often one is named within a moment: then the pilot hears of that one only
DOUBT_S = 3.0
# a link that flaps is said to be silent once, and to be back once it stays
SILENCE_OVER_S = 3.0
# MAVLink is lost after four to five of its heartbeats, which may be all that comes
MAVLINK_SILENT_S = 5.0
# of a bus that is sampled over MAVLink a frame may be lost, or a few seconds of them: that is no silence of the bus
SAMPLED_SILENT_S = 5.0

_CLEARS: Mapping[Clear, Event] = {Clear.RECOVERED: Event.GOOD, Clear.DISARMED: Event.DISARMED}


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
        confirms=_slow(verdict),
        relies_on=judgement.relies_on,
    )


def _slow(verdict: SpeedVerdict) -> bool:
    """Less way through the water than normal, ahead or astern; what is not known is not."""
    least_mps = min(abs(verdict.speed_min_mps), abs(verdict.speed_max_mps))
    return abs(verdict.speed_mps) < least_mps  # False for NaN


def supervisor(config: Config) -> Supervisor:
    """The supervisor that the configuration asks for."""
    settings, failsafe = config.supervisor, config.failsafe
    cleared_by = frozenset(_CLEARS[clear] for clear in settings.cleared_by)
    times = partial(_times, settings)
    doubt = times(settings.navigation)
    doubt = replace(doubt, suspect_s=max(doubt.suspect_s, DOUBT_S), fault_s=max(doubt.fault_s, DOUBT_S))
    navigation = failsafe.navigation_fault
    silence = Policy(DebounceTimes(0.0, 0.0, SILENCE_OVER_S))
    policies = {
        "thruster": Policy(
            times(settings.thruster), cleared_by, failsafe.thruster_fault, failsafe.thrusters_fault or ()
        ),
        "speed": Policy(times(settings.speed), cleared_by, failsafe.speed_fault),
        # a sensor that lies still lies after disarming: armed again, it is told again at once
        **dict.fromkeys(SUBJECTS.values(), Policy(times(settings.navigation), cleared_by, navigation)),
        "navigation": Policy(doubt, cleared_by, navigation),
        **dict.fromkeys(("link", "signal", GATEWAY), silence),
    }
    return Supervisor(
        policies,
        Settings(
            repeat_s=settings.repeat_s,
            suspect_repeat_s=settings.suspect_repeat_s,
            limit=RateLimit(settings.texts_per_minute),
            delay_s=failsafe.delay_s,
            interval_s=failsafe.interval_s,
            geometry=_geometry(config.thruster),
            watching=_watching(config),
        ),
    )


def _watching(config: Config) -> str:
    """What is watched, in the width of a text."""
    count = len(config.thruster)
    thrusters = [f"{count} thruster{'s' if count > 1 else ''}"] if count else []
    watches = {"speed": config.speed, "navigation": config.navigation}
    *rest, last = [*thrusters, *(name for name, table in watches.items() if table is not None)]
    return texts.fitted(f"Watching {' and '.join(filter(None, [', '.join(rest), last]))}")


def _times(settings: SupervisorTable, own: Times | None) -> DebounceTimes:
    """Times of a detector's subjects: its own, where they are given."""
    given = {} if own is None else own.model_dump(exclude_none=True)
    keys = ("suspect_after_s", "fault_after_s", "clear_after_s")
    return DebounceTimes(*(given.get(key, getattr(settings, key)) for key in keys))


def _geometry(thrusters: Iterable[Thruster]) -> Geometry:
    return Geometry(
        {f"thruster {one.number}": abs(one.down) for one in thrusters if one.down},
        {f"thruster {one.number}": hypot(one.ahead, one.right) for one in thrusters if one.ahead or one.right},
    )


def silence_watch(config: Config, signals: Iterable[Watched]) -> SilenceWatch:
    """The watch over all links of the configuration, and over what the channels need to hear."""
    silent_s = config.supervisor.silent_s
    sampled = frozenset(bus.name for bus in config.can if bus.forwarded)
    least_s = {MAVLINK: MAVLINK_SILENT_S, **dict.fromkeys(sampled, SAMPLED_SILENT_S)}
    limits_s = {link: max(silent_s, least_s.get(link, 0.0)) for link in config.links()}
    links = [
        Watched("link", f"link {link}", link, link, limit_s, carrier=MAVLINK if link in sampled else None)
        for link, limit_s in limits_s.items()
    ]
    autopilot = [Watched("signal", AUTOPILOT, "Autopilot", MAVLINK, limits_s[MAVLINK])] if config.mavlink else []
    patient = [
        replace(one, limit_s=max(one.limit_s, SAMPLED_SILENT_S)) if one.link in sampled else one for one in signals
    ]
    return SilenceWatch(links, [*autopilot, *patient])
