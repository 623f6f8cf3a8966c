"""Commissioning of one thruster: what its dives show of it, or what is missing in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from detectors.thruster import ThrusterConfig
from gateway.commissioning.dive import RecordedDive, ThrusterSamples
from gateway.commissioning.excitation import excitation
from gateway.commissioning.health import faulty_dives
from gateway.commissioning.part import Part, Setting
from gateway.commissioning.thruster_figures import thruster_figures
from gateway.commissioning.thruster_response import ThrusterResponse, response
from gateway.commissioning.thruster_words import missing, quantities, remarks
from gateway.config import Config
from gateway.config_sections import Thruster


@dataclass(frozen=True, slots=True)
class LearntThruster:
    """What came of one thruster.

    Attributes:
        number: of it.
        part: for the user.
        dives: those that have samples of it at its rate, in their order; samples: of each of these.
        response: None where that is not known.
    """

    number: int
    part: Part
    dives: tuple[RecordedDive, ...] = ()
    samples: tuple[ThrusterSamples, ...] = ()
    response: ThrusterResponse | None = None

    @property
    def sound(self) -> bool:
        """Whether nothing is missing."""
        return self.response is not None and not self.part.missing


def commission_thruster(
    thruster: Thruster, config: Config, dives: Sequence[RecordedDive], vouched: bool
) -> LearntThruster:
    """Learns one thruster.

    Args:
        thruster: which.
        config: with which settings of the detector.
        dives: all of them.
        vouched: the user says that they are healthy, whatever was found in them.
    """
    subject = f"thruster {thruster.number}"
    heard = [dive for dive in dives if thruster.number in dive.thrusters]
    if not heard:
        return LearntThruster(thruster.number, Part(subject, missing=(_unheard(thruster),)))
    rate_hz = _rate_hz([dive.thrusters[thruster.number] for dive in heard])
    used = tuple(dive for dive in heard if dive.thrusters[thruster.number].rate_hz == rate_hz)
    samples = tuple(dive.thrusters[thruster.number] for dive in used)
    driven, answer = excitation(samples), response(samples, config.detector.thruster)
    others = [dive.name for dive in heard if dive not in used]
    part = Part(
        subject,
        quantities=tuple(quantities(driven, answer)),
        missing=(*(() if vouched else faulty_dives("thruster", used, subject)), *missing(driven, answer, used)),
        remarks=tuple(remarks(thruster, driven, answer, rate_hz, others)),
        figures=tuple(thruster_figures(thruster, samples, answer)),
    )
    return LearntThruster(thruster.number, part, used, samples, answer)


def detector_settings(config: ThrusterConfig, thrusters: Sequence[LearntThruster]) -> ThrusterConfig:
    """Settings of a detector that finds the delay and lag of all of these thrusters."""
    found = [one.response.config for one in thrusters if one.response is not None]
    return replace(
        config,
        delay_max=max([config.delay_max, *(one.delay_max for one in found)]),
        lag_max=max([config.lag_max, *(one.lag_max for one in found)]),
        warmup=max([config.spans[2], *(one.spans[2] for one in found)]),
    )


def search_settings(config: ThrusterConfig, wanted: ThrusterConfig) -> Iterator[Setting]:
    """What of these settings the file does not say yet."""
    for name in ("delay_max", "lag_max", "warmup"):
        if getattr(wanted, name) != getattr(config, name):
            yield Setting(
                f"detector.thruster.{name}", getattr(wanted, name), "samples, for thrusters that answer late"
            )


def _unheard(thruster: Thruster) -> str:
    links = " and ".join(dict.fromkeys((thruster.command.link, thruster.rpm.link)))
    return (
        f"it has no sample in these logs: its command and its speed were not heard together over {links}. Are they of"
        " this vehicle, and complete?"
    )


def _rate_hz(samples: Sequence[ThrusterSamples]) -> float:
    """At which most was sampled: a delay in samples has no meaning at another rate."""
    seconds: Counter[float] = Counter()
    for one in samples:
        seconds[one.rate_hz] += int(len(one) / one.rate_hz)
    return seconds.most_common(1)[0][0]
