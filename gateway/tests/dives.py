"""Made-up innovations of healthy dives."""

import numpy as np

from detectors.navigation.lstm import INPUTS
from gateway.training.records import InnovationRecord


def record(name, count=60, seed=0, noise=0.01):
    """A dive whose innovations follow from the motion of this second and the last, but for white noise."""
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(count, INPUTS))
    before = np.vstack((np.zeros(INPUTS), features[:-1]))
    innovation = 0.1 * (features[:, :4] + before[:, 4:8]) + noise * rng.normal(size=(count, 4))
    variance = np.exp(-4.0 + 0.1 * features[:, 8:12])
    return InnovationRecord(name, np.arange(float(count)), features, innovation, variance)


def dives(count=5):
    return [record(f"dive {number}", count=50 + 7 * number, seed=number) for number in range(count)]
