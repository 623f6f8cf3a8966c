"""The vehicle's way through the pipeline: positions, attitudes and commands, pose samples, verdicts on its speed."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Protocol

from detectors.speed import PoseSample, SpeedConfig, SpeedCurve, SpeedVerdict
from detectors.speed.gridded_flow import GriddedFlow
from drivers.readings import (
    Attitude,
    AutopilotReboot,
    GlobalPosition,
    LocalPosition,
    PositionFix,
    Reading,
    ThrusterCommand,
)
from gateway.channel import Channel, Learnt, Source, SpeedJudgement
from gateway.config import Config
from gateway.config_sections import MAVLINK, Speed, Thruster
from gateway.pose import PoseAligner
from gateway.position import SILENT_S, PositionTrack
from gateway.silence import Watched
from gateway.thrust import Shares, ThrustDemand

SUBJECT = "vehicle"
HEADING, POSITION = "vehicle heading", "vehicle position"
# of the navigation watch: what the autopilot's heading, and its own position, are made from
HEADING_SENSORS: tuple[str, ...] = ("gyroscope",)
DEAD_RECKONING = ("dvl", *HEADING_SENSORS)
# what a sample is called that only brings a newer heading: as alignment meant it
REPEATED = "position repeated"
AUTOPILOT_KINDS = (Attitude, LocalPosition, GlobalPosition, PositionFix, AutopilotReboot)


class Detector(Protocol):
    """What the pipeline needs of a speed detector. `refused`: samples and positions that were not used, by cause."""

    refused: Counter[str]

    @property
    def curve(self) -> SpeedCurve | None:
        """Normal speed over the command, as far as it is known."""
        ...

    def update(self, sample: PoseSample) -> SpeedVerdict:
        """Judges one sample."""
        ...

    def accept(self) -> None:
        """Makes today's speed the normal one."""
        ...

    def resume(self) -> None:
        """After a restart of the program: the clock may be another, and what is wrong is to be found anew."""
        ...


SpeedFactory = Callable[[SpeedConfig, SpeedCurve | None], Detector]


class SpeedChannel(Channel[PoseSample]):
    """See `Channel`.

    Args:
        speed, settings: the configuration's speed watch, and its detector's settings.
        config: the rest of it.
        make: makes the detector.
    """

    def __init__(self, speed: Speed, settings: SpeedConfig, config: Config, make: SpeedFactory) -> None:
        demand = ThrustDemand(
            {one.number: Shares(one.ahead, one.right) for one in config.thruster}, config.align.stale_s
        )
        pushing = [one for one in config.thruster if one.number in demand.thrusters]
        super().__init__(SUBJECT, _sources(pushing), _signals(config.supervisor.silent_s))
        self._aligner = PoseAligner(PositionTrack(speed.position, speed.origin()), demand)
        self._detector = make(settings, None)
        self._remake = partial(make, settings)
        self._learns = settings.speed_curve is None and settings.speed_min_mps is None
        self._meaning = _meaning(pushing)
        self._settings = f"{_fingerprint(settings)} {speed.model_dump_json()}"

    @property
    def demand(self) -> ThrustDemand:
        """What takes the thrusters' commands."""
        return self._aligner.demand

    def remark(self) -> str:
        """Where positions come from."""
        source = self._aligner.track.source
        return "no position that moves" if source is None else f"positions from {source}"

    def accept(self) -> None:
        """The present speed is normal from now on."""
        self._detector.accept()

    def drops(self) -> Counter[str]:
        """What alignment and detector refused, by cause."""
        refused = self._detector.refused.items()
        return self._aligner.drops + Counter({f"speed: {cause}": n for cause, n in refused if cause != REPEATED})

    def learnt(self) -> Learnt:
        """Frame of the positions and detector."""
        return Learnt(self._meaning, self._settings, self._aligner.track.frame, self._detector)

    def recall(self, old: Learnt) -> bool:
        """Other settings leave only the normal speed, unless they give one themselves; other thrusters nothing."""
        if old.sources != self._meaning:
            return False
        if old.settings == self._settings:
            self._aligner.track.frame, self._detector = old.alignment, old.detector
            self._detector.resume()
        else:
            self._detector = self._remake(old.detector.curve if self._learns else None)
        return True

    def _align(self, reading: Reading) -> tuple[Sequence[PoseSample], str | None]:
        match reading:
            case ThrusterCommand():
                self.demand.command(reading.time_s, reading.thruster, reading.fraction)
            case Attitude():
                return self._aligner.attitude(reading), HEADING
            case LocalPosition() | GlobalPosition() | PositionFix():
                heard = POSITION if self._aligner.track.wants(reading) else None
                return self._aligner.position(reading), heard
            case AutopilotReboot():
                self._aligner.restart()
        return (), None

    def _judge(self, samples: Sequence[PoseSample]) -> Iterator[SpeedJudgement]:
        relies_on = DEAD_RECKONING if self._aligner.track.of_autopilot else HEADING_SENSORS
        for sample in samples:
            yield SpeedJudgement(sample, self._detector.update(sample), relies_on)


def _sources(pushing: Sequence[Thruster]) -> Iterator[Source]:
    yield from (Source(one.command.link, ThrusterCommand, one.number) for one in pushing)
    yield from (Source(MAVLINK, kind) for kind in AUTOPILOT_KINDS)


def _signals(silent_s: float) -> tuple[Watched, Watched]:
    """Positions may come once in five seconds, and on deck nobody misses them."""
    return (
        Watched("signal", HEADING, "Heading", MAVLINK, silent_s),
        Watched("signal", POSITION, "Position", MAVLINK, max(silent_s, SILENT_S), armed_only=True),
    )


def _meaning(pushing: Sequence[Thruster]) -> str:
    """What gives a learnt speed its meaning: the command that it belongs to."""
    parts = [one.model_dump_json(include={"number", "command", "ahead", "right"}) for one in pushing]
    return " ".join([SUBJECT, *parts])


def _fingerprint(settings: SpeedConfig) -> str:
    """The settings in one line. A forecast is in it by all of its numbers, of which its repr shows only a few."""
    flow = settings.flow_model
    if not isinstance(flow, GriddedFlow):
        return repr(settings)
    arrays = [getattr(flow, field.name) for field in fields(flow)]
    digest = hashlib.sha256(b"".join(repr(array.shape).encode() + array.tobytes() for array in arrays))
    return f"{replace(settings, flow_model=None)!r} forecast {digest.hexdigest()}"
