"""The estimators by their names in the settings."""

from __future__ import annotations

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.config import SpeedConfig
from detectors.speed.estimate import Estimator
from detectors.speed.interacting import InteractingEstimator
from detectors.speed.kalman import KalmanEstimator
from detectors.speed.published import flow_to_learn

ADAPTIVE_NOISE = 0.05  # position noise may make the adaptive law's speed waver by this share; it slows down for it


def new_estimator(config: SpeedConfig) -> Estimator:
    """The estimator that the settings name."""
    scale_mps = config.speed_scale_mps
    if config.estimator == "adaptive":
        return AdaptiveEstimator(
            flow_to_learn(config),
            learning_rate=config.learning_rate,
            gain=config.gain,
            speed_mps=scale_mps,
            speed_limit_mps=config.speed_limit_mps,
            speed_noise_max_mps=ADAPTIVE_NOISE * scale_mps,
        )
    if config.estimator == "kalman":
        return KalmanEstimator(
            config.dimensions,
            speed_scale_mps=scale_mps,
            speed_mps=scale_mps,
            position_noise_m=config.position_noise_m,
        )
    known = config.flow_model is not None
    return InteractingEstimator(config.dimensions, scale_mps, config.flow_model_error_mps if known else None)
