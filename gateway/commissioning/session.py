"""Commissioning from beginning to end: logs in; a configuration, a state file and a page out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from gateway import state
from gateway.commissioning.dive import RecordedDive
from gateway.commissioning.earlier import compared
from gateway.commissioning.part import Part, Quantity, Setting
from gateway.commissioning.settings_file import with_settings
from gateway.commissioning.state_file import Taught, taught
from gateway.commissioning.thresholds import SUBJECT, commission_thresholds
from gateway.commissioning.thruster import LearntThruster, commission_thruster, detector_settings, search_settings
from gateway.config import Config, parse

STATE, PAGE = "vehicle.state", "commissioning.html"


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the user wants.

    Attributes:
        false_alarms_per_hour: how many faults of each kind may be said of a healthy vehicle.
        vouched: the dives are healthy, whatever is found in them.

    Raises:
        ValueError: a rate that is not above 0.
    """

    false_alarms_per_hour: float = 0.1
    vouched: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.false_alarms_per_hour <= 100.0:
            raise ValueError(f"false_alarms_per_hour = {self.false_alarms_per_hour}: want above 0, to 100")


@dataclass(frozen=True, slots=True)
class Commissioning:
    """What came of it.

    Attributes:
        dives: what it was learnt from.
        parts: of all subjects.
        settings: what is new in the configuration.
        text: of the new configuration; None: nothing was learnt.
        state: of the state file, its bytes; None: no thruster is known.
    """

    dives: tuple[RecordedDive, ...]
    parts: tuple[Part, ...]
    settings: tuple[Setting, ...]
    text: str | None
    state: bytes | None

    @property
    def complete(self) -> bool:
        """Whether nothing is missing."""
        return not any(part.missing for part in self.parts)


def commission(
    source: Path,
    config: Config,
    dives: Sequence[RecordedDive],
    out: Path,
    wishes: Wishes,
    tell: Callable[[str], None],
) -> Commissioning:
    """Learns all subjects from dives.

    Args:
        source: file of the configuration.
        config: what is in it.
        dives: healthy ones.
        out: folder that the new one will lie in.
        wishes: of the user.
        tell: hears what is being done.

    Raises:
        OSError: the file cannot be read.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        thrusters = compared(list(_thrusters(config, dives, wishes, tell)), config.files.state)
        sound = [one for one in thrusters if one.sound]
        detecting = detector_settings(config.detector.thruster, sound)
        tell("looking for the thrusters' threshold")
        parts = [commission_thresholds(thrusters, detecting, wishes.false_alarms_per_hour)]
        parts += [*_others(config, dives, wishes, tell), *(one.part for one in thrusters)]
        settings = [setting for part in parts for setting in part.settings]
        if sound:
            settings += search_settings(config.detector.thruster, detecting)
            settings.append(Setting("files.state", STATE, f"knows {_numbers(sound)} already"))
        if not settings:
            return Commissioning(tuple(dives), tuple(parts), (), None, None)
        removed = [key for part in parts for key in part.removed]
        text = with_settings(source.read_text(encoding="utf-8"), settings, removed, source.parent, out)
        tell("judging the dives with the new configuration")
        known = taught(parse(text, out.resolve(), str(out / source.name)), sound)
    told = [_with_reached(part, known) if part.subject == SUBJECT else part for part in parts]
    packed = state.pack(known.state) if sound else None
    return Commissioning(tuple(dives), tuple(told), tuple(settings), text, packed)


def _thrusters(
    config: Config, dives: Sequence[RecordedDive], wishes: Wishes, tell: Callable[[str], None]
) -> Iterator[LearntThruster]:
    for thruster in config.thruster:
        tell(f"learning thruster {thruster.number}")
        yield commission_thruster(thruster, config, dives, wishes.vouched)


def _others(
    config: Config, dives: Sequence[RecordedDive], wishes: Wishes, tell: Callable[[str], None]
) -> Iterator[Part]:
    """Of what is watched beside thrusters."""
    if config.speed is not None:
        from gateway.commissioning.speed import commission_speed

        tell("learning the speed through the water")
        yield commission_speed(config, dives, wishes.false_alarms_per_hour, wishes.vouched)
    if config.navigation is not None:
        from gateway.commissioning.navigation import commission_navigation

        tell("learning the navigation sensors")
        yield commission_navigation(
            config, dives, wishes.false_alarms_per_hour, wishes.vouched, lambda what: tell(f"navigation: {what}")
        )


def _with_reached(part: Part, known: Taught) -> Part:
    reached = Quantity(
        "with the new configuration",
        f"{known.faults} false alarms",
        f"in {known.thruster_hours:.2f} hours of thrusters that were judged",
    )
    return replace(part, quantities=(*part.quantities, reached))


def _numbers(thrusters: Sequence[LearntThruster]) -> str:
    return ", ".join(f"T{one.number}" for one in thrusters)
