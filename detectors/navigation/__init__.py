"""Navigation watch: does a navigation sensor lie (paper 003, and beyond it)."""

from detectors.navigation.config import NavigationConfig
from detectors.navigation.detector import NavigationDetector
from detectors.navigation.installation import Installation
from detectors.navigation.sample import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FaultKind,
    FixSample,
    ImuSample,
    NavigationSample,
    NavigationState,
    NavigationVerdict,
    Sensor,
    SensorVerdict,
)

__all__ = [
    "AttitudeSample",
    "DepthSample",
    "DvlSample",
    "FaultKind",
    "FixSample",
    "ImuSample",
    "Installation",
    "NavigationConfig",
    "NavigationDetector",
    "NavigationSample",
    "NavigationState",
    "NavigationVerdict",
    "Sensor",
    "SensorVerdict",
]
