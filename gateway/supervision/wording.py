"""In which words, and how urgently, the pilot is told of a transition."""

from __future__ import annotations

from collections.abc import Collection

from detectors.verdict import Level
from gateway import texts
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.evidence import Geometry, explaining, one_cause
from gateway.supervision.levels import SEVERITY_OF_WORSE, Event, Say, Transition
from gateway.supervision.subject import Subject


class Wording:
    """Words for one subject among all of them.

    Args:
        subject: whose transition it is.
        subjects: all of them.
        geometry: which thruster drives the vehicle where.
        time_s: now.
    """

    def __init__(self, subject: Subject, subjects: Collection[Subject], geometry: Geometry, time_s: float) -> None:
        speeds = [one for one in subjects if one.seen.detector == "speed" and one.seen.confirms]
        causes = explaining(subjects, geometry) if speeds else []
        self._speed, self._level = subject.seen.detector == "speed", subject.level
        self._causes = causes if self._speed else [one for one in causes if one is subject]
        self._told = [one for one in self._causes if not one.silenced(time_s)]
        self._slow = [one for one in speeds if one is subject or one.level >= Level.SUSPECT]

    @property
    def explained(self) -> bool:
        """True where it is said with one of its causes, and as often."""
        return self._speed and any(one.level >= self._level and not one.acknowledged for one in self._told)

    def said_with(self, transition: Transition) -> list[Subject]:
        """Whose state the text of a transition tells as well."""
        as_one = transition.say is not Say.OVER and self._causes and self._slow
        return [*self._causes, *self._slow] if as_one else []

    def of(self, transition: Transition, event: Event, observation: Observation) -> tuple[Severity, str]:
        """Severity and text of a transition."""
        match transition.say:
            case Say.WORSE:
                known = self._speed and any(one.level is Level.FAULT for one in self._told)
                severity = Severity.WARNING if known else SEVERITY_OF_WORSE[transition.level]
                return severity, self._state(observation)
            case Say.REPEAT:
                return Severity.WARNING, self._state(observation)
            case Say.OVER if event is Event.GOOD:
                return Severity.NOTICE, observation.over_text()
            case Say.OVER if event is Event.DISTRUSTED:
                return Severity.NOTICE, observation.text()
            case Say.OVER:
                return Severity.NOTICE, texts.fitted(f"{observation.label} fault cleared: {event}")
            case Say.NOTHING:
                return Severity.INFO, observation.text()

    def _state(self, observation: Observation) -> str:
        """The state in words: of a slow vehicle and the thruster that makes it so, as one cause."""
        if self._causes and self._slow:
            return one_cause([one.seen for one in self._causes], self._slow[0].seen)
        return observation.text()
