"""What commissioning saw of a thruster: its curve with all samples, what it was told, and how it follows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.lag import follow_gain, followed
from gateway.commissioning.dive import ThrusterSamples
from gateway.commissioning.steady_curve import SLOW, SteadyCurve
from gateway.commissioning.thruster_response import ThrusterResponse
from gateway.config_sections import Thruster
from gateway.plotting.figure import Colour, Figure, Line, Panel, Points

FloatArray: TypeAlias = NDArray[np.float64]

SAMPLES_MAX = 1500  # points that are drawn
EXCERPT_S = 20.0
BINS = np.linspace(-1.0, 1.0, 41)
DEVIATIONS = 2.0  # that are drawn of an uncertainty


def thruster_figures(
    thruster: Thruster, dives: Sequence[ThrusterSamples], answer: ThrusterResponse | None
) -> Iterator[Figure]:
    """Its figures; without an answer only what it was told."""
    name = f"T{thruster.number}" + (f" {thruster.name}" if thruster.name else "")
    panels: tuple[Panel, ...] = (Panel("held, s", (_held(dives),), share=0.5),)
    if answer is not None:
        curve = answer.curve
        panels = (
            Panel("speed, rpm", tuple(_curve(dives, curve))),
            Panel("uncertainty, %", (_uncertainty(curve),), share=0.5),
            *panels,
        )
    yield Figure(
        name=f"thruster-{thruster.number}-curve",
        title=f"{name}: steady speed over command",
        panels=panels,
        about="Dots are single samples, also those on the way from one speed to another. Below: twice the standard"
        " deviation of the curve, relative to it; and for how long each command was held.",
        over_time=False,
        x_title="command",
    )
    if answer is not None:
        yield _excerpt(f"thruster-{thruster.number}-steps", name, dives, answer)


def _curve(dives: Sequence[ThrusterSamples], curve: SteadyCurve) -> Iterator[Points | Line]:
    command, speed_rpm = (np.concatenate([getattr(one, row) for one in dives]) for row in ("command", "speed_rpm"))
    few = slice(None, None, max(1, len(command) // SAMPLES_MAX))
    yield Points("samples", command[few], speed_rpm[few], Colour.FAINT)
    yield Line("learnt curve", curve.command, curve.speed_rpm, Colour.PREDICTED)


def _uncertainty(curve: SteadyCurve) -> Line:
    """In percent; next to standstill there is no saying what of."""
    fast = np.abs(curve.speed_rpm) > SLOW * np.abs(curve.speed_rpm).max()
    share = 100.0 * DEVIATIONS * curve.error_rpm / np.where(fast, np.abs(curve.speed_rpm), np.nan)
    still = int(np.searchsorted(curve.command, 0.0))
    command, percent = np.insert(curve.command, still, 0.0), np.insert(share, still, np.nan)
    return Line("uncertainty", command, percent, Colour.THRESHOLD)


def _held(dives: Sequence[ThrusterSamples]) -> Line:
    """Seconds in each bin of command."""
    seconds = sum(np.histogram(one.command, BINS)[0] / one.rate_hz for one in dives)
    return Line("held", BINS, np.append(seconds, 0.0), Colour.COMMAND, step=True)


def _excerpt(name: str, title: str, dives: Sequence[ThrusterSamples], answer: ThrusterResponse) -> Figure:
    """The liveliest seconds: measured speed, and what the curve, delay and lag make of the command."""
    samples, part = _liveliest(dives)
    since_s = samples.time_s[part] - samples.time_s[part][0]
    followed = _followed(samples, answer)[part]
    return Figure(
        name=name,
        title=f"{title}: how it follows its command",
        panels=(
            Panel(
                "command", (Line("command", since_s, samples.command[part], Colour.COMMAND, step=True),), share=0.5
            ),
            Panel(
                "speed, rpm",
                (
                    Line("measured", since_s, samples.speed_rpm[part], Colour.MEASURED),
                    Line("by curve, delay and lag", since_s, followed, Colour.PREDICTED),
                ),
            ),
        ),
        about="The liveliest seconds of all dives.",
        over_time=False,
        x_title="s",
    )


def _liveliest(dives: Sequence[ThrusterSamples]) -> tuple[ThrusterSamples, slice]:
    """The dive and the part of it in which the command changes most."""
    best, found = -1.0, (dives[0], slice(0, len(dives[0])))
    for one in dives:
        length = min(len(one), int(EXCERPT_S * one.rate_hz))
        travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(one.command)))])
        moved = travel[length - 1 :] - travel[: len(one) - length + 1]
        start = int(np.argmax(moved))
        if moved[start] > best:
            best, found = float(moved[start]), (one, slice(start, start + length))
    return found


def _followed(samples: ThrusterSamples, answer: ThrusterResponse) -> FloatArray:
    """(N,) speeds by curve, delay and lag; their magnitudes, where the sensor gives no more."""
    curve, delay = answer.curve, round(answer.delay_s.value * samples.rate_hz)
    commands, speeds = np.append(curve.command, 0.0), np.append(curve.speed_rpm, 0.0)
    order = np.argsort(commands)
    target = np.interp(samples.command, commands[order], speeds[order])
    delayed = np.concatenate([np.full(delay, target[0]), target[: len(target) - delay]])
    speed_rpm = followed(delayed, float(delayed[0]), follow_gain(answer.lag_s.value * samples.rate_hz))
    return np.abs(speed_rpm) if answer.unsigned else speed_rpm
