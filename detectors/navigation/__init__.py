"""Navigation watch: does a navigation sensor lie (paper 003, and beyond it)."""

from detectors.navigation.config import NavigationConfig
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
    "NavigationConfig",
    "NavigationSample",
    "NavigationState",
    "NavigationVerdict",
    "Sensor",
    "SensorVerdict",
]
