"""The navigation sensors' way through the pipeline: readings, samples in the order of time, verdicts on each sensor.

What was learnt of the sensors' installation (lever arm, mounting, scale, delays) is kept over a restart of the
program. All else is found anew: nobody knows how the vehicle moved meanwhile.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from detectors.navigation import NavigationConfig, NavigationSample
from drivers.readings import (
    Attitude,
    AutopilotClock,
    AutopilotReboot,
    BodyVelocity,
    GlobalPosition,
    Inertial,
    PositionFix,
    Reading,
    WaterPressure,
)
from gateway.channel import Channel, Learnt, NavigationJudgement, Source
from gateway.config_sections import MAVLINK, Navigation
from gateway.motion import MotionAligner
from gateway.sensor_observations import SUBJECTS
from gateway.sensor_watch import NavigationFactory, SensorWatch
from gateway.silence import Watched

SUBJECT = "navigation"
IMU, DVL, DEPTH = "imu signal", "dvl signal", "depth signal"
READING_KINDS = (
    Inertial,
    BodyVelocity,
    WaterPressure,
    GlobalPosition,
    PositionFix,
    Attitude,
    AutopilotClock,
    AutopilotReboot,
)

# A DVL loses the bottom now and then, and that is no news.
DVL_SILENT_S, DEPTH_SILENT_S = 5.0, 3.0


class NavigationChannel(Channel[NavigationSample]):
    """See `Channel`.

    Args:
        navigation, settings: the configuration's navigation watch, and its detector's settings.
        silent_s: silence of the inertial unit that is told.
        make: makes the detector, once there is a state to begin with.
    """

    def __init__(
        self, navigation: Navigation, settings: NavigationConfig, silent_s: float, make: NavigationFactory
    ) -> None:
        sources = (Source(MAVLINK, kind) for kind in READING_KINDS)
        super().__init__(SUBJECT, sources, _signals(navigation, silent_s))
        self._aligner = MotionAligner(navigation)
        self._watch = SensorWatch(navigation, settings, make)
        self._meaning = navigation.model_dump_json(
            exclude={"water_density_kgm3", "surface_pressure_pa", "lstm_model"}
        )

    def told(self) -> tuple[str, ...]:
        """The sensors, and what cannot be blamed on one of them."""
        return SUBJECT, *SUBJECTS.values()

    def remark(self) -> str:
        """Where the samples come from, and how fast the inertial ones."""
        aligner = self._aligner
        chosen = filter(None, (aligner.imu.chosen, aligner.dvl.chosen, aligner.depth.chosen))
        return ", ".join([*chosen, f"IMU at {self._watch.rate_hz:.0f} Hz"])

    def accept(self) -> None:
        """The sensors are well as they are."""
        self._watch.accept()

    def drops(self) -> Counter[str]:
        """What alignment and detector refused, by cause."""
        refused = {f"navigation: {cause}": n for cause, n in self._watch.refused.items()}
        return self._aligner.drops + Counter(refused)

    def learnt(self) -> Learnt:
        """How the sensors are installed."""
        return Learnt(self._meaning, "", None, self._watch.installation)

    def recall(self, old: Learnt) -> bool:
        """Other sensors, or another first guess of their installation, leave nothing."""
        if old.sources != self._meaning:
            return False
        self._watch.recall(old.detector)
        return True

    def _align(self, reading: Reading) -> tuple[Sequence[NavigationSample], str | None]:
        aligner = self._aligner
        match reading:
            case Inertial():
                return aligner.inertial(reading), IMU if aligner.imu.wants(reading.source) else None
            case BodyVelocity():
                aligner.velocity(reading)
                return (), DVL if aligner.dvl.wants(reading.source) else None
            case WaterPressure():
                return (), DEPTH if aligner.pressure(reading) else None
            case GlobalPosition():
                return (), DEPTH if aligner.position(reading) else None
            case PositionFix():
                aligner.fix(reading)
            case Attitude():
                aligner.attitude(reading)
            case AutopilotClock():
                aligner.clock(reading)
            case AutopilotReboot():
                aligner.restart()
        return (), None

    def _judge(self, samples: Sequence[NavigationSample]) -> Iterator[NavigationJudgement]:
        return map(self._watch.judge, samples)


def _signals(navigation: Navigation, silent_s: float) -> Iterator[Watched]:
    yield Watched("signal", IMU, "IMU", MAVLINK, silent_s)
    if navigation.dvl != "none":
        yield Watched("signal", DVL, "DVL", MAVLINK, max(silent_s, DVL_SILENT_S), armed_only=True)
    if navigation.depth != "none":
        yield Watched("signal", DEPTH, "Depth", MAVLINK, max(silent_s, DEPTH_SILENT_S))
