"""Made-up dives for the watch over speed and navigation, as commissioning gets them."""

from types import SimpleNamespace

from detectors.navigation import NavigationConfig
from detectors.speed import SpeedConfig
from detectors.verdict import Level
from gateway.channel import SpeedJudgement
from gateway.commissioning.dive import RecordedDive
from gateway.config_sections import Navigation
from gateway.findings import Finding
from gateway.severity import Severity


def speed_config(settings=None):
    """As much of a configuration as the speed's commissioning looks at."""
    return SimpleNamespace(detector=SimpleNamespace(speed=settings or SpeedConfig()))


def navigation_config(navigation=None, settings=None):
    """The same of the navigation's; about where the made-up dives are."""
    where = {"latitude_deg": 32.66, "longitude_deg": 34.95}
    return SimpleNamespace(
        navigation=navigation or Navigation(**where),
        detector=SimpleNamespace(navigation=settings or NavigationConfig()),
    )


def speed_dive(poses, name="dive", findings=()):
    judged = [SpeedJudgement(one, None, ()) for one in poses]
    return RecordedDive(name, 0.0, poses[-1].time_s if poses else 0.0, {}, judged, [], list(findings))


def navigation_dive(samples, name="dive", findings=()):
    return RecordedDive(name, 0.0, samples[-1].time_s if samples else 0.0, {}, [], samples, list(findings))


def fault(detector, subject, text="Speed 40 % low"):
    return Finding(65.0, detector, subject, Level.FAULT, 1.2, text, Severity.ERROR)
