"""A thruster as a recorded stretch of samples shows it: the default method's model of it, without judging."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.history import ROWS, TIME, History
from detectors.thruster.identification import learn
from detectors.thruster.model import ThrusterModel
from detectors.thruster.search import search_named
from detectors.thruster.window import window_of

FloatArray = NDArray[np.float64]


def model_of_stretch(block: FloatArray, config: ThrusterConfig) -> tuple[ThrusterModel, float] | None:
    """What a stretch of samples shows of its thruster, learnt as the default method learns it.

    Args:
        block: (5, N) time, command, speed, voltage, current (NaN: not measured); in order of time, evenly spaced but
            for gaps.
        config: settings; all of the stretch may be the window, whatever they say of windows.

    Returns:
        The model and the samples' period in seconds; None where the stretch is shorter than `window_min` and
        `delay_max`, or shows too little.
    """
    samples = block.shape[1]
    window_min, _, _ = config.spans
    if samples < window_min + config.delay_max or not np.isfinite(block[: TIME + 3]).all():
        return None
    history = History(ROWS, samples)
    history.append(np.concatenate([block, np.ones((1, samples))]))
    window, period_s = window_of(history, config.delay_max, samples, config.delay_max)
    search = search_named(
        config.search, order_max=config.order_max, window_min=samples // 2, window_max=samples, seed=config.seed
    )
    model = learn(window, config, search)
    return None if model is None else (model, period_s)
