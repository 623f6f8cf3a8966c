"""The three experiments of paper 000, sections 6.2-6.4, rebuilt: what is commanded, what the sea does, what breaks.

The paper's recordings are not public. What its text tells of them is rebuilt with the physics of `paper_vehicles`.
The rest is assumed: the shape of the commands, drawn at random from the seed, and how strong waves, currents and
dragging are, set so that their effect on the speed has the size of the residuals in the paper's figures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_tests.paper_vehicles import HOV, PERIOD_S, PORTABLE, SAUCER, Circumstances, ThrusterPlant, simulate

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that breaks.

    Attributes:
        name: what it is.
        sample: the first one at which it acts on the shaft.
        until: the first one at which something else happens, so that a finding from there on is not of this fault.
        found: its sample, counted from 1 at the first, at which the paper found it; None where it does not say.
    """

    name: str
    sample: int
    until: int
    found: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One recording, and what is true of it.

    Attributes:
        name: of the experiment.
        command: (N,) in the vehicle's unit.
        speed_rpm: (N,) as measured.
        threshold_rpm: the paper's bound of the residual.
        faults: what breaks, in order of time.
    """

    name: str
    command: FloatArray
    speed_rpm: FloatArray
    threshold_rpm: float
    faults: tuple[Fault, ...] = ()


def hov_sea_trial(seed: int, samples: int = 1600) -> Trial:
    """Section 6.2: a pilot at the stick, near the surface, no fault; threshold 80.

    Interfering: waves (inflow with a period of 7 s), turbulence, other consumers on the supply, a slow discharge.
    From sample 840 on the working state changes: the vehicle turns to and fro in a current.
    """
    rng = np.random.default_rng(seed)
    command = _slewed(_held(rng.uniform(1.0, 4.5, 60), rng, samples, 4.0, 12.0), rate_per_s=0.8)
    seconds = _seconds(samples)
    height = 0.08 * (1.0 + 0.3 * _wandering(rng, samples, 20.0))
    waves = height * np.sin(2.0 * np.pi * seconds / 7.0 + rng.uniform(0.0, 6.0))
    turbulence = 0.04 * _wandering(rng, samples, 1.0)
    current = 0.25 * _smooth_steps(rng, samples, start=840, every=(10.0, 30.0))
    consumers_on = _held(rng.uniform(0.0, 1.0, 40), rng, samples, 5.0, 40.0) > 0.6
    supply = 1.0 - 0.03 * seconds / seconds[-1] - 0.02 * consumers_on
    return _trial(HOV, rng, command, 80.0, inflow=waves + turbulence + current, supply=supply)


def saucer_pool_test(seed: int, samples: int = 1500) -> Trial:
    """Section 6.3: dragged by hand, water injected, wake thrown back by the wall; cloth strips at 1280 and 1380.

    The vehicle keeps its station: the command swings by itself around a mean that is changed from time to time. A
    strip winds itself around the shaft within 0.3 s and stays, and raises the torque.
    """
    rng = np.random.default_rng(seed)
    mean = _slewed(_held(rng.uniform(2.0, 3.8, 20), rng, samples, 12.0, 25.0), rate_per_s=0.12)
    command = mean + 0.35 * _swinging(rng, samples, (9.0, 13.0, 21.0))
    drag = 0.1 * _smooth_steps(rng, samples, start=560, every=(8.0, 25.0))
    inflow = drag + 0.006 * _wandering(rng, samples, 1.0)
    load = 1.0 + 0.8 * _onset(samples, 1280, 0.3) + 1.2 * _onset(samples, 1380, 0.3)
    supply = 1.0 - 0.01 * _seconds(samples) / (samples * PERIOD_S)
    # the paper: "near" 1280, seen at 1282, certain at 1283; the second "in" 1380, without the sample of its finding
    faults = (Fault("first cloth strip", 1280, 1380, found=4), Fault("second cloth strip", 1380, samples))
    return _trial(SAUCER, rng, command, 8.0, inflow=inflow, supply=supply, load=load, faults=faults)


def portable_sea_trial(seed: int, samples: int = 3100) -> Trial:
    """Section 6.4: sailing in shallow water; weeds near 2400, a protective stop, a restart, a blocked shaft at 2870.

    Weeds gather within 1 s. The command then goes to zero, and at the restart more weeds come, until the shaft is
    held.
    """
    rng = np.random.default_rng(seed)
    cruise = _slewed(_held(rng.uniform(45.0, 85.0, 40), rng, samples, 15.0, 40.0), rate_per_s=3.0)
    cruise = cruise + 2.5 * _swinging(rng, samples, (6.0, 11.0, 17.0))
    running = 1.0 - _onset(samples, 2520, 3.0) + _onset(samples, 2700, 8.0)
    inflow = 0.05 * _smooth_steps(rng, samples, start=560, every=(15.0, 50.0)) + 0.008 * _wandering(rng, samples, 1.5)
    load = 1.0 + 0.8 * _onset(samples, 2400, 1.0) + 0.6 * _onset(samples, 2700, 10.0)
    supply = 1.0 - 0.03 * _seconds(samples) / (samples * PERIOD_S)
    blocked = np.arange(samples) >= 2870
    return _trial(
        PORTABLE,
        rng,
        cruise * running,
        8.0,
        inflow=inflow,
        supply=supply,
        load=load,
        blocked=blocked,
        faults=(Fault("weeds", 2400, 2520, found=28), Fault("blocked shaft", 2870, samples)),
    )


TRIALS: tuple[Callable[[int], Trial], ...] = (hov_sea_trial, saucer_pool_test, portable_sea_trial)


def _trial(
    plant: ThrusterPlant,
    rng: np.random.Generator,
    command: FloatArray,
    threshold_rpm: float,
    *,
    inflow: FloatArray,
    supply: FloatArray,
    load: FloatArray | None = None,
    blocked: NDArray[np.bool_] | None = None,
    faults: tuple[Fault, ...] = (),
) -> Trial:
    n = len(command)
    around = Circumstances(
        inflow=inflow,
        supply=supply,
        load=np.ones(n) if load is None else load,
        blocked=np.zeros(n, dtype=bool) if blocked is None else blocked,
    )
    speed_rpm = simulate(plant, command, around, rng)
    return Trial(name=plant.name, command=command, speed_rpm=speed_rpm, threshold_rpm=threshold_rpm, faults=faults)


def _seconds(samples: int) -> FloatArray:
    return np.arange(samples, dtype=np.float64) * PERIOD_S


def _held(
    levels: FloatArray, rng: np.random.Generator, samples: int, shortest_s: float, longest_s: float
) -> FloatArray:
    """Each level held for a random while, again from the first after the last."""
    lengths = (rng.uniform(shortest_s, longest_s, samples) / PERIOD_S).astype(int)
    return np.repeat(np.resize(levels, samples), np.maximum(lengths, 1))[:samples]


def _slewed(target: FloatArray, rate_per_s: float) -> FloatArray:
    """The target followed at a bounded rate."""
    step = rate_per_s * PERIOD_S
    followed = target.copy()
    for i in range(1, len(target)):
        followed[i] = followed[i - 1] + np.clip(target[i] - followed[i - 1], -step, step)
    return followed


def _swinging(rng: np.random.Generator, samples: int, periods_s: tuple[float, ...]) -> FloatArray:
    """A sum of swings of these periods at random phases, of unit variance."""
    phases = rng.uniform(0.0, 2.0 * np.pi, len(periods_s))
    waves = [np.sin(2.0 * np.pi * _seconds(samples) / t + phase) for t, phase in zip(periods_s, phases, strict=True)]
    return np.asarray(np.sum(waves, axis=0) * np.sqrt(2.0 / len(periods_s)))


def _wandering(rng: np.random.Generator, samples: int, memory_s: float) -> FloatArray:
    """An Ornstein-Uhlenbeck process of unit variance."""
    keep = np.exp(-PERIOD_S / memory_s)
    kicks = rng.normal(0.0, np.sqrt(1.0 - keep**2), samples)
    values = np.empty(samples)
    value = rng.normal()
    for i, kick in enumerate(kicks):
        value = keep * value + kick
        values[i] = value
    return values


def _smooth_steps(rng: np.random.Generator, samples: int, start: int, every: tuple[float, float]) -> FloatArray:
    """Zero until `start`, then random levels in -1..1, each held for a while and reached within some 10 s."""
    levels = _held(rng.uniform(-1.0, 1.0, 60), rng, samples, *every)
    levels[:start] = 0.0
    return _slewed(levels, rate_per_s=0.1)


def _onset(samples: int, start: int, rise_s: float) -> FloatArray:
    """0 before `start`, then up to 1 within `rise_s`."""
    return np.clip((np.arange(samples) - start + 1) * PERIOD_S / rise_s, 0.0, 1.0)
