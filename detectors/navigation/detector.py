"""Navigation detector: says which navigation sensor lies, and goes on without it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.admission import Admission, numbers_of
from detectors.navigation.blame import INERTIAL, NAMED, Suspicion, named, suspicions
from detectors.navigation.condition import Condition
from detectors.navigation.config import NavigationConfig
from detectors.navigation.innovation import Innovation
from detectors.navigation.installation import Installation
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.isolation import Isolation
from detectors.navigation.published import Residuals, Score, published_methods
from detectors.navigation.ratio import Explanation, LikelihoodRatio
from detectors.navigation.sample import (
    DepthSample,
    DvlSample,
    FaultKind,
    ImuSample,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
    Sensor,
    SensorVerdict,
    Vector,
)
from detectors.navigation.thresholds import ratio_threshold
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

MEASURED: dict[Sensor, type[DvlSample | DepthSample]] = {Sensor.DVL: DvlSample, Sensor.DEPTH: DepthSample}
# The filter has found itself when it has had so long and so many samples of the DVL, and expects the next so well.
SETTLING_S, SETTLING_SAMPLES, SETTLED_MPS = 20.0, 10, 0.25
SUSPECT_SHARE = 0.7
# A sensor on probation is suspected sooner.
PROBATION_SHARE = 0.5
# An isolated sensor is to blame beyond doubt when an inertial one explains so much less, or after so long.
BEYOND_DOUBT, PENDING_S = 25.0, 20.0
# So long after an inertial sensor's jump, what seems wrong with others is what the jump has left behind.
SHAKEN_S = 60.0
# Without any innovation, verdicts are looked at again so often: sensors may have fallen silent.
CONCLUSION_S = 1.0
# An inertial sensor's jump is over when the bias is back within this share of it.
RECOVERED = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class _Jump:
    """An inertial sensor's bias that is another than it was."""

    suspicion: Suspicion
    healthy: FloatArray

    def over(self, bias: Vector) -> bool:
        return bool(np.linalg.norm(bias - self.healthy) < RECOVERED * np.linalg.norm(self.suspicion.size))


class NavigationDetector:
    """Judges navigation sensors by how well they agree (paper 003, and beyond it).

    Pickled at any sample and unpickled, it goes on bit for bit.

    Args:
        config: settings.
        initial: where the vehicle is, about; see `detectors.navigation.alignment`.
        installation: how the sensors are mounted, as a detector learnt it before; None: the configuration's guess.
    """

    def __init__(
        self, config: NavigationConfig, initial: NavigationState, installation: Installation | None = None
    ) -> None:
        self._config = config
        self._admission = Admission()
        self._filter = IntegratedFilter(config, initial, installation)
        self._ratio = LikelihoodRatio()
        self._threshold = ratio_threshold(config.false_alarms_per_hour)
        self._methods = published_methods(config)
        self._residuals = Residuals()
        self._scores: dict[str, Score] = {}
        self._conditions = {sensor: Condition() for sensor in MEASURED}
        self._isolated: dict[Sensor, Isolation] = {}
        self._jumps: dict[Sensor, _Jump] = {}
        # isolated, while an inertial sensor may still be the one to blame; and since when
        self._pending: Sensor | None = None
        self._pending_s, self._jumped_s = 0.0, -inf
        self._suspicions: list[Suspicion] = []
        self._explanations: list[Explanation] = []
        self._doubtful: tuple[Sensor, ...] = ()
        self._innovation = (nan, nan, nan, nan)
        self._time_s = self._began_s = self._concluded_s = initial.time_s
        self._settled = False
        self._dvl_samples = 0
        self._sensors: tuple[SensorVerdict, ...] = ()
        self._level, self._score, self._reason = Level.UNKNOWN, 0.0, "no sample of the DVL yet"
        self._statistics: dict[str, float] = {}
        self._position_error_m = self._filter.position_error_m

    @property
    def refused(self) -> Counter[str]:
        """Samples that were not taken, by cause."""
        return self._admission.refused + self._filter.refused

    @property
    def installation(self) -> Installation:
        """How the sensors are mounted, as learnt: for the next detector."""
        return self._filter.installation

    def update(self, sample: NavigationSample) -> NavigationVerdict:
        """Judges one sample. Never raises on data: what is late, repeated or not finite is refused and counted."""
        if self._admission.admits(sample):
            self._time_s = max(self._time_s, sample.time_s)
            if isinstance(sample, ImuSample):
                for innovation in self._filter.advance(sample):
                    self._judge(innovation)
                    self._conclude()
            else:
                self._filter.measure(sample)
            if self._time_s - self._concluded_s > CONCLUSION_S:
                self._conclude()
        return self._verdict()

    def accept(self) -> None:
        """The operator says that all sensors are well: they are used again, and their mounting is learnt anew.

        A new scale, angle or place of the DVL and a new offset of the depth become normal by that. An offset of the
        DVL's velocity does not: no mounting makes one, and it is found again.
        """
        for sensor in tuple(self._isolated):
            self._readmit(sensor)
        self._begin_anew()
        self._conclude()

    def _judge(self, innovation: Innovation) -> None:
        """One innovation, by all methods; then what follows from them."""
        sensor = _sensor(innovation)
        # fixes and headings err for long in the same way: no evidence against others
        counts = sensor is not None and (sensor not in self._isolated or sensor is self._pending)
        self._ratio.update(innovation, counts=counts)
        self._examine(innovation, sensor)
        if sensor is None:
            return
        self._keep(sensor, innovation)
        condition = self._conditions[sensor]
        condition.update(numbers_of(innovation.measurement), innovation)
        if (residual := self._residuals.take(innovation)) is not None:
            self._dvl_samples += 1
            self._scores = {name: method.judge(residual) for name, method in self._methods.items()}
        if not self._settled:
            self._settle(innovation)
            return
        self._suspect()
        self._act()
        self._forgive()
        if self._isolated.keys() == MEASURED.keys():
            self._rescue()

    def _examine(self, innovation: Innovation, sensor: Sensor | None) -> None:
        """Whether an isolated sensor can be used again."""
        for isolated, isolation in tuple(self._isolated.items()):
            condition = self._conditions[isolated]
            score, kind = condition.evidence()
            isolation.update(
                innovation,
                self._filter.covariance,
                own=sensor is isolated,
                sound=not condition.repeated and score < SUSPECT_SHARE,
                limit=PROBATION_SHARE * self._threshold,
            )
            if condition.repeated:
                isolation.call(FaultKind.STUCK)
            elif kind is FaultKind.NOISE and score >= 1.0:
                isolation.call(kind)
            if sensor is isolated and isolation.healed(innovation.time_s, self._config.healthy_s):
                self._readmit(isolated)

    def _keep(self, sensor: Sensor, innovation: Innovation) -> None:
        x, y, z, down = self._innovation
        if sensor is Sensor.DVL:
            x, y, z = innovation.values.tolist()
        else:
            down = float(innovation.values[0])
        self._innovation = (x, y, z, down)

    def _settle(self, innovation: Innovation) -> None:
        """Waits until the filter expects the DVL well; begins anew where it is wrong."""
        waited = innovation.time_s - self._began_s >= SETTLING_S and self._dvl_samples >= SETTLING_SAMPLES
        if not waited or not isinstance(innovation.measurement, DvlSample):
            return
        if sqrt(float(np.trace(innovation.covariance)) / 3.0) > SETTLED_MPS:
            return
        if self._ratio.ratios().max() > self._threshold:
            self._begin_anew()
        else:
            self._settled = True

    def _begin_anew(self, *, shaken: bool = False) -> None:
        self._filter.begin_anew(shaken=shaken)
        self._ratio.clear()
        for condition in self._conditions.values():
            condition.clear()
        if not shaken:
            self._jumps.clear()
        self._pending = None
        self._suspicions, self._doubtful = [], ()
        self._settled, self._dvl_samples, self._began_s = False, 0, self._time_s

    def _suspect(self) -> None:
        """What there is against whom."""
        if self._config.method != "ratio":
            score = self._scores.get(self._config.method)
            self._suspicions = [] if score is None else [Suspicion(score.sensor, FaultKind.UNCLEAR, score.share)]
            return
        explanations = self._explanations = self._ratio.explanations()
        conditions = {sensor: one for sensor, one in self._conditions.items() if sensor not in self._isolated}
        possible = named(explanations)
        self._suspicions = suspicions(
            [one for one in explanations if one.family.sensor in possible], self._threshold, conditions
        )
        if self._pending is not None:  # one fault explains it all, whoever's it is
            self._suspicions = [one for one in self._suspicions if one.sensor not in INERTIAL]
        found = bool(explanations) and explanations[0].ratio > self._threshold
        self._doubtful = possible if found and len(possible) > 1 else ()

    def _act(self) -> None:
        """Isolates a sensor that is surely broken; takes the jump of an inertial sensor's bias in."""
        if self._pending is not None:
            self._resolve(self._pending)
            return
        worst = next((one for one in self._suspicions if one.sensor not in self._isolated), None)
        if worst is None or worst.score < 1.0 or not self._config.isolate:
            return
        if self._doubtful and not worst.proven:
            return
        if worst.sensor in INERTIAL:
            self._jump(worst)
            return
        if self._time_s - self._jumped_s < SHAKEN_S and not worst.proven:
            self._begin_anew(shaken=True)
            return
        self._isolated[worst.sensor] = Isolation(worst.sensor, worst.kind, worst.size, worst.rate)
        self._filter.excluded.add(MEASURED[worst.sensor])
        rival = max((one.weight for one in self._explanations if one.family.sensor in INERTIAL), default=0.0)
        if worst.explanation is not None and not worst.proven and rival > worst.explanation.weight - BEYOND_DOUBT:
            self._pending, self._pending_s = worst.sensor, self._time_s
        else:
            self._take_in(worst.explanation)

    def _resolve(self, sensor: Sensor) -> None:
        """A sensor was isolated, but an inertial one could have made it look so: what followed tells them apart."""
        self._doubtful = ()
        own = next((one for one in self._explanations if one.family.sensor is sensor), None)
        rival = next((one for one in self._explanations if one.family.sensor in INERTIAL), None)
        if own is None or rival is None:
            self._take_in(own)
        elif rival.weight > own.weight + NAMED:
            del self._isolated[sensor]
            self._filter.excluded.discard(MEASURED[sensor])
            self._jump(Suspicion(rival.family.sensor, rival.family.kind, rival.ratio / self._threshold, rival))
        elif rival.weight < own.weight - BEYOND_DOUBT or self._time_s - self._pending_s > PENDING_S:
            self._take_in(own)

    def _jump(self, suspicion: Suspicion) -> None:
        """An inertial sensor's bias is another now."""
        sensor = suspicion.sensor
        healthy = self._jumps[sensor].healthy if sensor in self._jumps else np.array(self._bias(sensor))
        self._jumps[sensor], self._jumped_s = _Jump(suspicion, healthy), self._time_s
        self._take_in(suspicion.explanation)

    def _take_in(self, explanation: Explanation | None) -> None:
        """Mends what a fault has done to the filter, and looks for the next one."""
        if explanation is not None:
            self._filter.correct(*self._ratio.consequences(explanation))
        self._ratio.clear()
        self._suspicions, self._doubtful, self._pending = [], (), None

    def _rescue(self) -> None:
        """All sensors contradict dead reckoning: then that is wrong, whatever made it so. Begins anew with them."""
        for sensor in tuple(self._isolated):
            self._isolated[sensor].probation = None
            self._readmit(sensor)
        self._begin_anew(shaken=True)

    def _readmit(self, sensor: Sensor) -> None:
        probation = self._isolated.pop(sensor).probation
        if probation is not None:
            self._filter.replace(probation.error, probation.covariance)
        self._filter.excluded.discard(MEASURED[sensor])
        self._conditions[sensor].clear()
        self._ratio.clear()
        self._pending = None

    def _forgive(self) -> None:
        """Inertial sensors whose bias is again what it was."""
        for sensor, jump in tuple(self._jumps.items()):
            if jump.over(self._bias(sensor)):
                del self._jumps[sensor]

    def _bias(self, sensor: Sensor) -> Vector:
        strapdown = self._filter.strapdown
        if sensor is Sensor.GYROSCOPE:
            return strapdown.gyroscope_bias_radps
        return strapdown.accelerometer_bias_mps2

    def _conclude(self) -> None:
        """The verdict on each sensor, and on all of them."""
        self._concluded_s = self._time_s
        self._sensors = tuple(self._sensor_verdicts())
        worst = max((one.score for one in self._sensors), default=0.0)
        self._level = max((one.level for one in self._sensors), default=Level.UNKNOWN)
        self._score = worst
        self._reason = self._reasons()
        self._statistics = {name: score.share for name, score in self._scores.items()}
        if self._config.method == "ratio":
            self._statistics["ratio"] = max((one.score for one in self._suspicions), default=0.0)
        elif self._config.compare:
            self._statistics["ratio"] = float(self._ratio.ratios().max()) / self._threshold
        self._position_error_m = self._filter.position_error_m
        if self._doubtful:
            self._level = Level.FAULT

    def _sensor_verdicts(self) -> Iterator[SensorVerdict]:
        for sensor in Sensor:
            yield self._sensor_verdict(sensor)

    def _sensor_verdict(self, sensor: Sensor) -> SensorVerdict:
        if sensor in self._isolated:
            isolation = self._isolated[sensor]
            return SensorVerdict(
                sensor, Level.FAULT, 1.0, isolation.kind, isolation.size, isolation.rate, isolated=True
            )
        if sensor in self._jumps:
            found = self._jumps[sensor].suspicion
            return SensorVerdict(sensor, Level.FAULT, max(found.score, 1.0), found.kind, found.size, found.rate)
        suspicion = next((one for one in self._suspicions if one.sensor is sensor), None)
        score = 0.0 if suspicion is None else max(suspicion.score, 0.0)
        if not self._settled or sensor in self._doubtful or self._silent(sensor):
            return SensorVerdict(sensor, Level.UNKNOWN, score)
        if suspicion is None or score < SUSPECT_SHARE:
            return SensorVerdict(sensor, Level.NORMAL, score)
        level = Level.FAULT if score >= 1.0 else Level.SUSPECT
        return SensorVerdict(sensor, level, score, suspicion.kind, suspicion.size, suspicion.rate)

    def _silent(self, sensor: Sensor) -> bool:
        """Not heard, or not to be judged without another that is not heard: the inertial sensors without the DVL, and
        all without the inertial ones."""
        kinds = (ImuSample, MEASURED.get(sensor, DvlSample))
        return any(not self._admission.heard(one) or self._admission.silent(one, self._time_s) for one in kinds)

    def _reasons(self) -> str:
        if self._doubtful:
            return " or ".join(self._doubtful)
        if not self._settled:
            return "finding out how the sensors are mounted" if self._dvl_samples else "no sample of the DVL yet"
        troubles = [f"{one.sensor} {one.kind}" for one in self._sensors if one.kind is not None]
        kinds: list[tuple[str, type[NavigationSample]]] = [("imu", ImuSample), *MEASURED.items()]
        silent = [f"{name} silent" for name, kind in kinds if self._admission.silent(kind, self._time_s)]
        return ", ".join(troubles + silent)

    def _verdict(self) -> NavigationVerdict:
        return NavigationVerdict(
            time_s=self._time_s,
            level=self._level,
            score=self._score,
            state=self._filter.state(self._time_s),
            innovation=self._innovation,
            statistics=self._statistics,
            isolated=tuple(self._isolated),
            sensors=self._sensors,
            position_error_m=self._position_error_m,
            reason=self._reason,
        )


def _sensor(innovation: Innovation) -> Sensor | None:
    return next((sensor for sensor, kind in MEASURED.items() if isinstance(innovation.measurement, kind)), None)
