"""Abnormal speed under unknown flow after paper 002 (Cho, Zhang and Edwards 2021, International Journal of Advanced
Robotic Systems), and beyond it."""

from detectors.speed.basis import FlowBasis
from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve
from detectors.speed.detector import SpeedDetector
from detectors.speed.flow import FlowModel
from detectors.speed.sample import PoseSample, SpeedVerdict

__all__ = [
    "FlowBasis",
    "FlowModel",
    "PoseSample",
    "SpeedConfig",
    "SpeedCurve",
    "SpeedDetector",
    "SpeedVerdict",
]
