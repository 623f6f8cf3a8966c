"""What follows from a fault: the sensor is done without, or the filter is put right, until all is well again.

A DVL or a depth sensor that is broken is isolated, and used again when it has agreed for long enough. Nothing works
without the inertial sensors: the jump of a bias is taken in.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from detectors.navigation.blame import INERTIAL, NAMED, Blame, Suspicion
from detectors.navigation.condition import Condition
from detectors.navigation.config import NavigationConfig
from detectors.navigation.innovation import Innovation
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.isolation import Isolation
from detectors.navigation.jumps import Jumps
from detectors.navigation.ratio import Explanation, LikelihoodRatio
from detectors.navigation.sample import MEASURED, FaultKind, Sensor, measured_by
from detectors.navigation.thresholds import PROBATION_SHARE, SUSPECT_SHARE, ratio_threshold

# An isolated sensor is to blame beyond doubt when an inertial one explains so much less, or after so long.
BEYOND_DOUBT, PENDING_S = 25.0, 20.0


class Outcome(Enum):
    """What has become of what the sensors were blamed for."""

    STANDS = "stands"
    TAKEN_IN = "taken in"  # the filter is as if there had been no fault: from now on it would be another
    SHAKEN = "shaken"  # the filter is wrong itself, after an inertial sensor's jump: it has to begin anew


class Accommodation:
    """Isolates sensors and uses them again; puts the filter right.

    Args:
        config: settings.
        navigation: the filter that is put right.
        ratio: the likelihood ratios that follow it.
        conditions: what the samples of each sensor in `MEASURED` show.

    Attributes:
        isolated: sensors whose measurements are not used.
        jumps: inertial sensors whose bias is another than it was.
    """

    def __init__(
        self,
        config: NavigationConfig,
        navigation: IntegratedFilter,
        ratio: LikelihoodRatio,
        conditions: Mapping[Sensor, Condition],
    ) -> None:
        self.isolated: dict[Sensor, Isolation] = {}
        self.jumps = Jumps()
        # isolated, while an inertial sensor may still be the one to blame; and since when
        self._pending: Sensor | None = None
        self._pending_s = 0.0
        self._config, self._threshold = config, ratio_threshold(config.false_alarms_per_hour)
        self._filter, self._ratio, self._conditions = navigation, ratio, conditions

    @property
    def pending(self) -> bool:
        """A sensor is isolated, and an inertial one may still be to blame."""
        return self._pending is not None

    def counts(self, sensor: Sensor) -> bool:
        """Whether its innovations are evidence."""
        return sensor not in self.isolated or sensor is self._pending

    def examine(self, innovation: Innovation) -> None:
        """Uses isolated sensors again that have agreed for long enough."""
        sensor = measured_by(innovation.measurement)
        for isolated, isolation in tuple(self.isolated.items()):
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

    def act(self, blame: Blame, time_s: float) -> Outcome:
        """Isolates a sensor that is surely broken; takes the jump of an inertial sensor's bias in."""
        outcome = self._respond(blame, time_s)
        self.jumps.forgive(self._filter.strapdown)
        if self.isolated.keys() == MEASURED.keys():
            # all sensors contradict dead reckoning: then that is wrong, whatever made it so
            for isolation in self.isolated.values():
                isolation.probation = None
            self.readmit()
            return Outcome.SHAKEN
        return outcome

    def readmit(self) -> None:
        """Uses all sensors again."""
        for sensor in tuple(self.isolated):
            self._readmit(sensor)

    def begin_anew(self, *, shaken: bool) -> None:
        """Finds itself again, with the sensors that are used; `shaken`: after an inertial sensor's jump."""
        self._filter.begin_anew(shaken=shaken)
        self._ratio.clear()
        if not shaken:
            self.jumps.clear()
        self._pending = None

    def _respond(self, blame: Blame, time_s: float) -> Outcome:
        if self._pending is not None:
            return self._resolve(self._pending, blame, time_s)
        worst = next((one for one in blame.suspicions if one.sensor not in self.isolated), None)
        if worst is None or worst.score < 1.0 or not self._config.isolate:
            return Outcome.STANDS
        if blame.doubtful and not worst.proven:
            return Outcome.STANDS
        if worst.sensor in INERTIAL:
            return self._jump(worst, time_s)
        if self.jumps.shaken(time_s) and not worst.proven:
            return Outcome.SHAKEN
        return self._isolate(worst, blame, time_s)

    def _isolate(self, worst: Suspicion, blame: Blame, time_s: float) -> Outcome:
        self.isolated[worst.sensor] = Isolation(worst.sensor, worst.kind, worst.size, worst.rate)
        self._filter.excluded.add(MEASURED[worst.sensor])
        rival = max((one.weight for one in blame.explanations if one.family.sensor in INERTIAL), default=0.0)
        if worst.explanation is not None and not worst.proven and rival > worst.explanation.weight - BEYOND_DOUBT:
            self._pending, self._pending_s = worst.sensor, time_s
            return Outcome.STANDS
        return self._take_in(worst.explanation)

    def _resolve(self, sensor: Sensor, blame: Blame, time_s: float) -> Outcome:
        """A sensor was isolated, but an inertial one could have made it look so: what followed tells them apart."""
        own = next((one for one in blame.explanations if one.family.sensor is sensor), None)
        rival = next((one for one in blame.explanations if one.family.sensor in INERTIAL), None)
        if own is None or rival is None:
            return self._take_in(own)
        if rival.weight > own.weight + NAMED:
            del self.isolated[sensor]
            self._filter.excluded.discard(MEASURED[sensor])
            found = Suspicion(rival.family.sensor, rival.family.kind, rival.ratio / self._threshold, rival)
            return self._jump(found, time_s)
        if rival.weight < own.weight - BEYOND_DOUBT or time_s - self._pending_s > PENDING_S:
            return self._take_in(own)
        return Outcome.STANDS

    def _jump(self, suspicion: Suspicion, time_s: float) -> Outcome:
        """An inertial sensor's bias is another now."""
        self.jumps.add(suspicion, self._filter.strapdown, time_s)
        return self._take_in(suspicion.explanation)

    def _take_in(self, explanation: Explanation | None) -> Outcome:
        """Mends what a fault has done to the filter, and looks for the next one."""
        if explanation is not None:
            self._filter.correct(*self._ratio.consequences(explanation))
        self._ratio.clear()
        self._pending = None
        return Outcome.TAKEN_IN

    def _readmit(self, sensor: Sensor) -> None:
        probation = self.isolated.pop(sensor).probation
        if probation is not None:
            self._filter.replace(probation.error, probation.covariance)
        self._filter.excluded.discard(MEASURED[sensor])
        self._conditions[sensor].clear()
        self._ratio.clear()
        self._pending = None
