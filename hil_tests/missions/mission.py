"""Random missions of one vehicle in moving water, healthy or with a lasting loss of speed: what the speed detector is
measured on.

The ranges are those of the detector's target: a flow of up to 1.5 times the vehicle's speed, positions with a noise
of 0.1 to 2 m at 1 to 10 Hz; zig-zag, lawnmower and circle; headings that are off by noise and by a constant; speeds
that vary by a few percent, and a little sideslip in turns. A mission is its seed: with another loss, or seen by
another sensor, it is still the same vehicle, course and water.

"plain" missions keep to the letter of that: flows that are constant, tidal or spatial, white noise, even instants.
"rough" missions fill in what happens as well: flows that turn or set in within seconds, wandering noise, gaps,
repeated positions, outliers, jumps, vehicles that make centimetres per second.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from hil_tests.missions.course import KINDS, Course, Kind, random_course
from hil_tests.missions.fixes import (
    Sensors,
    measured_headings,
    measured_positions,
    random_instants,
    random_sensors,
    wander,
)
from hil_tests.missions.passage import Passage, remaining
from hil_tests.missions.water import WaterKind, carry, integral, random_water

FloatArray = NDArray[np.float64]
Style = Literal["plain", "rough"]

SPEED_MPS = (0.3, 2.0)
SLOW_MPS, SLOW_SHARE = (0.03, 0.3), 0.15  # of rough missions; seen by finer sensors, as in a tank
FLOW_MAX = 1.5  # relative to the vehicle's speed
DURATION_S = (300.0, 600.0)
NOISE_M = (0.1, 2.0)
SLOW_NOISE_S = (0.1, 1.0)  # noise of slow vehicles, in seconds of their way
RATE_HZ = (1.0, 10.0)
RATES_HZ = (1.0, 2.0, 4.0, 5.0, 10.0)
FOUND_WITHIN_S = 90.0  # a loss begins so long before the end, at least
RAMP_S = (1.0, 2.0)  # within which it grows
SPEED_SPREAD = {"plain": 0.015, "rough": 0.02}  # greatest standard deviation of a healthy speed, relative
SPEED_WANDER_S = (5.0, 30.0)
SLIP_S = {"plain": 0.2, "rough": 0.4}  # greatest drift angle for each unit of yaw rate
TURN_LOSS = {"plain": 0.0, "rough": 0.05}  # greatest relative loss of speed in the hardest turn
TURN_LOSS_S = 2.0
NORMAL = 0.15  # a speed this much off the nominal one is still normal
STEP_S = 0.05  # of the simulation
SETTLED_S = 3.0  # a loss "on a straight leg" begins so long after the turn


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mission(Passage):
    """One mission and what is true of it.

    Attributes:
        seed, style: that it was made from.
        nominal_speed_mps: what the vehicle is known to make; 15 % less or more is normal.
        drawn: everything else that was drawn, by name.
    """

    seed: int
    style: Style
    nominal_speed_mps: float
    drawn: dict[str, float | str]


@dataclass(frozen=True, slots=True)
class _Plan:
    """What kind of mission it is to be, as drawn."""

    kind: Kind
    water: WaterKind
    duration_s: float
    speed_mps: float
    flow_mps: float
    noise_m: float
    rate_hz: float
    speed_spread: float
    speed_wander_s: float
    slip_s: float
    turn_loss: float
    onset: float  # share of the instants at which a loss may begin
    ramp_s: float


@dataclass(frozen=True, slots=True, eq=False)
class _Truth:
    """What happened, at even and short steps: (M,) or (M, 2) each."""

    time_s: FloatArray
    course: Course
    speed_mps: FloatArray
    position_m: FloatArray
    flow_mps: FloatArray
    onset_s: float

    def at(self, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """(N, K) of (M, K) values, at other instants."""
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in values.T])


def random_mission(
    seed: int,
    loss: float = 0.0,
    style: Style = "plain",
    *,
    noise_m: float | None = None,
    rate_hz: float | None = None,
    on_straight: bool = False,
) -> Mission:
    """The mission of this seed.

    Args:
        seed: 0 or more.
        loss: lasting relative loss of speed, from some instant of the second half on; 0.0 for none.
        style: "plain" or "rough", see above.
        noise_m, rate_hz: of the positions, instead of what the seed draws.
        on_straight: the loss begins on a straight leg; a course that has none, a circle, becomes a lawnmower.

    Raises:
        ValueError: an argument out of range.
    """
    _check(seed, loss, style, noise_m, rate_hz)
    # one stream each, so that a mission seen by another sensor, or in other water, is still the same
    plan_stream, truth_stream, sensor_stream = np.random.default_rng([get_args(Style).index(style), seed]).spawn(3)
    plan = _plan(plan_stream, style, on_straight)
    plan = replace(plan, noise_m=noise_m or plan.noise_m, rate_hz=rate_hz or plan.rate_hz)
    truth = _simulate(truth_stream, plan, loss, on_straight)
    sensors = random_sensors(sensor_stream, plan.noise_m, plan.duration_s, style == "rough")
    time_s = random_instants(sensor_stream, plan.rate_hz, plan.duration_s, style == "rough")
    return Mission(
        seed=seed,
        style=style,
        kind=plan.kind,
        nominal_speed_mps=plan.speed_mps,
        speed_min_mps=(1.0 - NORMAL) * plan.speed_mps,
        speed_max_mps=(1.0 + NORMAL) * plan.speed_mps,
        loss=loss,
        onset_s=truth.onset_s if loss else float("nan"),
        noise_m=plan.noise_m,
        rate_hz=plan.rate_hz,
        drawn={**asdict(plan), **asdict(sensors)},
        **_seen(sensor_stream, sensors, truth, time_s),
    )


def _seen(rng: np.random.Generator, sensors: Sensors, truth: _Truth, time_s: FloatArray) -> dict[str, FloatArray]:
    """The (N,) and (N, 2) of a mission: what is true at these instants, and what the sensors say."""
    position_m = truth.at(time_s, truth.position_m)
    heading_rad, speed_mps = truth.at(time_s, np.column_stack([truth.course.heading_rad, truth.speed_mps])).T
    measured_m = measured_positions(rng, sensors, time_s, position_m)
    return {
        "time_s": time_s,
        "north_m": measured_m[:, 0],
        "east_m": measured_m[:, 1],
        "down_m": np.zeros(len(time_s)),
        "heading_rad": measured_headings(rng, sensors, heading_rad),
        "pitch_rad": np.zeros(len(time_s)),
        "true_position_m": position_m,
        "true_heading_rad": heading_rad,
        "true_speed_mps": speed_mps,
        "true_flow_mps": truth.at(time_s, truth.flow_mps),
    }


def _check(seed: int, loss: float, style: str, noise_m: float | None, rate_hz: float | None) -> None:
    if seed < 0:
        raise ValueError(f"seed = {seed}: want 0 or more")
    if not 0.0 <= loss < 1.0:
        raise ValueError(f"loss = {loss}: want 0 or more, below 1")
    if style not in get_args(Style):
        raise ValueError(f"style = {style!r}: want one of {', '.join(get_args(Style))}")
    for name, value in {"noise_m": noise_m, "rate_hz": rate_hz}.items():
        if value is not None and not value > 0.0:
            raise ValueError(f"{name} = {value}: want more than 0, or None")


def _plan(rng: np.random.Generator, style: Style, on_straight: bool) -> _Plan:
    rough = style == "rough"
    waters: tuple[WaterKind, ...] = get_args(WaterKind) if rough else get_args(WaterKind)[:3]
    kind = KINDS[rng.integers(len(KINDS))]
    slow = bool(rng.random() < SLOW_SHARE) and rough
    speed_mps = _log_uniform(rng, *SLOW_MPS) if slow else rng.uniform(*SPEED_MPS)
    return _Plan(
        kind="lawnmower" if on_straight and kind == "circle" else kind,
        water=waters[rng.integers(len(waters))],
        duration_s=rng.uniform(*DURATION_S),
        speed_mps=speed_mps,
        flow_mps=speed_mps * rng.uniform(0.0, FLOW_MAX),
        noise_m=speed_mps * _log_uniform(rng, *SLOW_NOISE_S) if slow else _log_uniform(rng, *NOISE_M),
        rate_hz=_log_uniform(rng, *RATE_HZ) if rough else float(rng.choice(RATES_HZ)),
        speed_spread=rng.uniform(0.0, SPEED_SPREAD[style]),
        speed_wander_s=rng.uniform(*SPEED_WANDER_S),
        slip_s=rng.uniform(0.0, SLIP_S[style]),
        turn_loss=rng.uniform(0.0, TURN_LOSS[style]),
        onset=rng.random(),
        ramp_s=rng.uniform(*RAMP_S),
    )


def _simulate(rng: np.random.Generator, plan: _Plan, loss: float, on_straight: bool) -> _Truth:
    time_s = np.arange(0.0, plan.duration_s + STEP_S, STEP_S)
    course = random_course(rng, plan.kind, time_s)
    healthy_mps = _healthy_speed(rng, plan, course)
    onset_s = _onset(plan, time_s, course if on_straight else None)
    speed_mps = healthy_mps * remaining(time_s, loss, onset_s, plan.ramp_s)
    # a hull slips outwards in a turn: in one to starboard (positive), to port
    slip_mps = -speed_mps * plan.slip_s * course.yaw_rate_radps
    ahead = np.column_stack([np.cos(course.heading_rad), np.sin(course.heading_rad)])
    right = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    # the water is drawn around the healthy way, so that a loss leaves it as it is
    water = random_water(rng, plan.water, plan.flow_mps, time_s, integral(time_s, healthy_mps[:, np.newaxis] * ahead))
    position_m, flow_mps = carry(water, time_s, speed_mps[:, np.newaxis] * ahead + slip_mps[:, np.newaxis] * right)
    return _Truth(time_s, course, speed_mps, position_m, flow_mps, onset_s)


def _healthy_speed(rng: np.random.Generator, plan: _Plan, course: Course) -> FloatArray:
    """It wanders within two standard deviations, and falls a little in turns."""
    keep = float(np.exp(-STEP_S / plan.speed_wander_s))
    wandering = np.clip(wander(rng, len(course.heading_rad), keep), -2.0, 2.0)
    turning = np.abs(course.yaw_rate_radps) / np.abs(course.yaw_rate_radps).max()
    share = -np.expm1(-STEP_S / TURN_LOSS_S)
    slowed = plan.turn_loss * np.asarray(lfilter([share], [1.0, share - 1.0], turning))
    return np.asarray(plan.speed_mps * (1.0 + plan.speed_spread * wandering - slowed))


def _onset(plan: _Plan, time_s: FloatArray, course: Course | None) -> float:
    """Somewhere in the second half with time left to find it; with a course, on a straight leg of it."""
    fitting = (time_s >= 0.5 * plan.duration_s) & (time_s <= plan.duration_s - FOUND_WITHIN_S)
    if course is not None:
        settled = int(SETTLED_S / STEP_S)
        turned = np.concatenate([[0], np.cumsum(~course.straight)])
        fitting[settled:] &= turned[settled + 1 :] == turned[1:-settled]
    instants = np.flatnonzero(fitting)
    return float(time_s[instants[int(plan.onset * len(instants))]])


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
