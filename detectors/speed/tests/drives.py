"""Simulated drives through a flow, as the steps that an estimator takes."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, cos, nan, sin

import numpy as np

from detectors.speed.estimate import Step

PIECE_S = 0.1  # longest piece into which an interval is cut for the true motion


def zig_zag(leg_s=20.0):
    """Headings north, east, south, west, each held for a while."""
    return lambda t: 0.3 + np.pi / 2 * (t // leg_s % 4)


def circling(period_s=80.0):
    return lambda t: 2 * np.pi * t / period_s


def drive(times, *, flow, speed, heading, start=(0.0, 0.0), noise_m=0.0, seed=0, pitch=0.0):
    """Start position, and the steps to each following time.

    flow: (D,), or a function of time and position. speed: a number, or a function of time. heading: of time.
    """
    flow_at = flow if callable(flow) else lambda t, x: np.asarray(flow)
    speed_at = speed if callable(speed) else lambda t: speed
    rng = np.random.default_rng(seed)
    position = np.array(start, dtype=float)
    dimensions = len(position)
    first = position + noise_m * rng.normal(size=dimensions)
    steps = []
    for before, now in pairwise(times):
        pieces = max(2, ceil((now - before) / PIECE_S))
        piece = (now - before) / pieces
        ahead_s = np.zeros(dimensions)
        for k in range(pieces):
            t = before + (k + 0.5) * piece
            bow = np.array([cos(heading(t)) * cos(pitch), sin(heading(t)) * cos(pitch), -sin(pitch)])[:dimensions]
            middle = position + 0.5 * piece * (flow_at(t, position) + speed_at(t) * bow)
            position = position + piece * (flow_at(t, middle) + speed_at(t) * bow)
            ahead_s = ahead_s + piece * bow
        seen = position + noise_m * rng.normal(size=dimensions)
        nothing = np.zeros(dimensions)
        noise = noise_m if noise_m > 0.0 else nan
        steps.append(Step(float(now), float(now - before), seen, ahead_s, nothing, nothing, noise))
    return first, steps


def run(estimator, first, steps, time_s=0.0):
    """The estimates after each step."""
    estimator.begin(first, time_s)
    return [estimator.update(step) for step in steps]


def irregular(seconds, seed, shortest_s=0.02, longest_s=5.0):
    """Times with intervals spread evenly over the decades from the shortest to the longest."""
    rng = np.random.default_rng(seed)
    intervals = np.exp(rng.uniform(np.log(shortest_s), np.log(longest_s), int(seconds / shortest_s)))
    times = np.concatenate(([0.0], np.cumsum(intervals)))
    return times[times <= seconds]
