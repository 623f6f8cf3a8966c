"""Navigation detector: says which navigation sensor lies, and goes on without it."""

from __future__ import annotations

from collections import Counter
from math import nan

from detectors.navigation.accommodation import Accommodation, Outcome
from detectors.navigation.admission import Admission, numbers_of
from detectors.navigation.blame import Blame, Suspicion, blame
from detectors.navigation.conclusion import MISSED, Conclusion, Situation, conclude
from detectors.navigation.condition import Condition
from detectors.navigation.config import NavigationConfig
from detectors.navigation.innovation import Innovation
from detectors.navigation.installation import Installation
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.published import Residuals, Score, published_methods
from detectors.navigation.ratio import LikelihoodRatio
from detectors.navigation.sample import (
    MEASURED,
    FaultKind,
    ImuSample,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
    Sensor,
    measured_by,
)
from detectors.navigation.settling import Settling
from detectors.navigation.thresholds import ratio_threshold

# Without any innovation, verdicts are looked at again so often: sensors may have fallen silent.
CONCLUSION_S = 1.0


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
        self._settling = Settling(initial.time_s)
        self._conditions = {sensor: Condition() for sensor in MEASURED}
        self._ratio, self._threshold = LikelihoodRatio(), ratio_threshold(config.false_alarms_per_hour)
        self._residuals, self._methods = Residuals(), published_methods(config)
        self._scores: dict[str, Score] = {}
        self._blame = Blame()
        self._accommodation = Accommodation(config, self._filter, self._ratio, self._conditions)
        self._innovation = (nan, nan, nan, nan)
        self._time_s = self._concluded_s = initial.time_s
        self._conclusion = Conclusion()
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
        self._accommodation.readmit()
        self._begin_anew()
        self._conclude()

    def _judge(self, innovation: Innovation) -> None:
        """One innovation, by all methods; then what follows from them."""
        sensor = measured_by(innovation.measurement)
        # fixes and headings err for long in the same way: no evidence against others
        counts = sensor is not None and self._accommodation.counts(sensor)
        self._ratio.update(innovation, counts=counts)
        self._accommodation.examine(innovation)
        if sensor is None:
            return
        self._keep(sensor, innovation)
        self._conditions[sensor].update(numbers_of(innovation.measurement), innovation)
        if (residual := self._residuals.take(innovation)) is not None:
            self._scores = {name: method.judge(residual) for name, method in self._methods.items()}
        if self._settling.settled:
            self._respond()
        elif self._settling.expects(innovation):
            self._begin()

    def _keep(self, sensor: Sensor, innovation: Innovation) -> None:
        x, y, z, down = self._innovation
        if sensor is Sensor.DVL:
            x, y, z = innovation.values.tolist()
        else:
            down = float(innovation.values[0])
        self._innovation = (x, y, z, down)

    def _begin(self) -> None:
        """Judges from now on; begins anew where the filter is sure of what is wrong."""
        if self._ratio.ratios().max() > self._threshold:
            self._begin_anew()
        else:
            self._settling.settled = True

    def _begin_anew(self, *, shaken: bool = False) -> None:
        self._accommodation.begin_anew(shaken=shaken)
        for condition in self._conditions.values():
            condition.clear()
        self._settling.begin(self._time_s)
        self._blame = Blame()

    def _respond(self) -> None:
        """Who is to blame, and what is done about it."""
        self._blame = self._found()
        match self._accommodation.act(self._blame, self._time_s):
            case Outcome.TAKEN_IN:
                self._blame = Blame()
            case Outcome.SHAKEN:
                self._begin_anew(shaken=True)

    def _found(self) -> Blame:
        if self._config.method != "ratio":
            score = self._scores.get(self._config.method)
            return Blame([] if score is None else [Suspicion(score.sensor, FaultKind.UNCLEAR, score.share)])
        isolated, pending = self._accommodation.isolated, self._accommodation.pending
        conditions = {sensor: one for sensor, one in self._conditions.items() if sensor not in isolated}
        return blame(self._ratio.explanations(), self._threshold, conditions, explained=pending)

    def _conclude(self) -> None:
        """What is said until the next innovation."""
        self._concluded_s = self._time_s
        self._conclusion = conclude(self._situation())
        self._statistics = {name: score.share for name, score in self._scores.items()}
        if self._config.method == "ratio":
            self._statistics["ratio"] = self._blame.worst
        elif self._config.compare:
            self._statistics["ratio"] = float(self._ratio.ratios().max()) / self._threshold
        self._position_error_m = self._filter.position_error_m

    def _situation(self) -> Situation:
        return Situation(
            isolated=self._accommodation.isolated,
            jumped=self._accommodation.jumps.found,
            blame=self._blame,
            settled=self._settling.settled,
            begun=self._settling.samples > 0,
            silent=frozenset(kind for _, kind in MISSED if self._admission.silent(kind, self._time_s)),
            unheard=frozenset(kind for _, kind in MISSED if not self._admission.heard(kind)),
        )

    def _verdict(self) -> NavigationVerdict:
        return NavigationVerdict(
            time_s=self._time_s,
            level=self._conclusion.level,
            score=self._conclusion.score,
            state=self._filter.state(self._time_s),
            innovation=self._innovation,
            statistics=self._statistics,
            isolated=tuple(self._accommodation.isolated),
            sensors=self._conclusion.sensors,
            position_error_m=self._position_error_m,
            reason=self._conclusion.reason,
        )
