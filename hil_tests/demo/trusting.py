"""What the gateway would have taken for the truth, had it gone on using a faulty sensor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from detectors.navigation import NavigationDetector, NavigationSample, NavigationState
from gateway.config import Config
from gateway.sensor_watch import SensorWatch


def trusting_states(config: Config, samples: Iterable[NavigationSample]) -> Iterator[NavigationState]:
    """States by a detector that isolates nothing, from the same samples, aligned in the same way.

    Args:
        config: of the gateway.
        samples: as the gateway judged them, from the first one on.

    Raises:
        ValueError: the configuration has no navigation watch.
    """
    navigation, settings = config.navigation, config.detector.navigation
    if navigation is None or settings is None:
        raise ValueError("a configuration without [navigation]: want one that watches the navigation sensors")
    watch = SensorWatch(navigation, replace(settings, isolate=False), NavigationDetector)
    return (watch.judge(sample).verdict.state for sample in samples)
