"""Thruster fault detection after paper 000 (Xu et al. 2021, Applied Sciences 11, 3586), and beyond it."""

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.detector import ThrusterDetector, ThrusterVerdicts
from detectors.thruster.learnt import LearntCurve
from detectors.thruster.sample import FaultKind, ThrusterSample, ThrusterVerdict
from detectors.thruster.wear import CommissionedCurve

__all__ = [
    "CommissionedCurve",
    "FaultKind",
    "LearntCurve",
    "ThrusterConfig",
    "ThrusterDetector",
    "ThrusterSample",
    "ThrusterVerdict",
    "ThrusterVerdicts",
]
