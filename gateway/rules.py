"""From configuration and detectors to the supervisor's terms: who is watched, by which rules, in which words."""

from __future__ import annotations

import math

from detectors.thruster.sample import ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from gateway import texts
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.debounce import DebounceTimes
from gateway.failsafe import FailsafePolicy
from gateway.silence import SilenceWatch, Watched
from gateway.supervisor import Observation, Policy, Supervisor

# a link that flaps is said to be silent once, and to be back once it stays
SILENCE_OVER_S = 3.0
# MAVLink is lost after four to five of its heartbeats, which may be all that comes
MAVLINK_SILENT_S = 5.0

CONFLICT = "link mavlink autopilots"


def thruster_observation(number: int, sample: ThrusterSample, verdict: ThrusterVerdict) -> Observation:
    """What the supervisor is told of a thruster's verdict."""
    details = texts.thruster_details(sample, verdict)
    if verdict.level is Level.UNKNOWN:
        details = (verdict.reason,) if verdict.reason else ()
    return Observation(
        time_s=verdict.time_s,
        detector="thruster",
        subject=f"thruster {number}",
        label=f"T{number}",
        level=verdict.level,
        score=verdict.score,
        trouble=texts.thruster_trouble(verdict),
        details=details,
    )


def autopilots_observation(time_s: float, system_ids: tuple[int, ...]) -> Observation:
    """Several autopilots on one link, or, with none named, that there is one again."""
    level = Level.SUSPECT if system_ids else Level.NORMAL
    trouble = f"has several autopilots: {', '.join(map(str, system_ids))}"
    return Observation(time_s, "link", CONFLICT, MAVLINK, level, math.nan, trouble)


def supervisor(config: Config) -> Supervisor:
    """The supervisor that the configuration asks for."""
    settings, failsafe = config.supervisor, config.failsafe
    thruster_times = DebounceTimes(settings.suspect_after_s, settings.fault_after_s, settings.clear_after_s)
    silence = Policy(DebounceTimes(0.0, 0.0, SILENCE_OVER_S))
    thruster = Policy(thruster_times, cleared_by_disarm=True, failsafe=True, told=failsafe.thruster_fault != "none")
    return Supervisor(
        {"thruster": thruster, "link": silence, "signal": silence},
        FailsafePolicy(failsafe.thruster_fault, failsafe.interval_s),
        settings.repeat_s,
    )


def silence_watch(config: Config) -> SilenceWatch:
    """The watch over all links, commands and speeds of the configuration."""
    silent_s = config.supervisor.silent_s
    limits_s = {link: max(silent_s, MAVLINK_SILENT_S) if link == MAVLINK else silent_s for link in config.links()}
    links = [Watched("link", f"link {link}", link, link, limit_s) for link, limit_s in limits_s.items()]
    signals = [
        Watched("signal", f"thruster {one.number} {what}", f"T{one.number} {label}", link, silent_s, armed_only)
        for one in config.thruster
        for what, label, link, armed_only in (
            ("command", "command", one.command.link, True),
            ("rpm", "RPM", one.rpm.link, False),
        )
    ]
    return SilenceWatch(links, signals)
