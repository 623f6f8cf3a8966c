"""The speed watch's settings out of `[speed]` and `[detector.speed]`, and what in these tables contradicts itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from detectors.speed import SpeedConfig, SpeedCurve
from gateway.config_sections import SPEED_MAX_MPS, Speed, Thruster
from gateway.detector_settings import DetectorSettings, Setting
from gateway.flow_settings import flow_model
from gateway.problems import Problem

# settings of the detector, by their names, that have a place in [speed]
RANGE_KEYS = {"speed_min_mps": "minimum_mps", "speed_max_mps": "maximum_mps", "range_command": "command"}
SPEED_KEYS = {**RANGE_KEYS, "tolerance": "tolerance"}
NO_AHEAD = "needs ahead on the thrusters that drive the vehicle"

Points = Sequence[tuple[float, float]]


def speed_settings(speed: Speed, table: object) -> tuple[SpeedConfig | None, list[Problem]]:
    """What the detector is given, or everything that is wrong with it by itself.

    Args:
        speed: `[speed]`. What `contradictions` or `curve_problems` tell of it is not told again.
        table: `[detector.speed]`, as it is in the file.
    """
    problems: list[Problem] = []
    keys = {"tolerance": "tolerance"} if any(_range_problems(speed)) else SPEED_KEYS
    elsewhere = {
        name: Setting(f"speed.{key}", value)
        for name, key in keys.items()
        if (value := getattr(speed, key)) is not None
    }
    if speed.curve is not None:
        problems += curve_problems(speed.curve)
        curve = None if problems else SpeedCurve(*zip(*speed.curve, strict=True))
        elsewhere["speed_curve"] = Setting("speed.curve", curve)
    if speed.flow is not None:
        flow, wrong = flow_model(speed.flow)
        problems += wrong
        elsewhere["flow_model"] = Setting("speed.flow", flow)
    left_out = ("basis", "flow_model", "speed_curve", *SPEED_KEYS)
    settings, refused = DetectorSettings(SpeedConfig, "detector.speed", elsewhere, left_out).read(table)
    return settings, [*problems, *map(_in_the_files_words, refused)]


def _in_the_files_words(problem: Problem) -> Problem:
    wanted = problem.wanted
    for name, key in RANGE_KEYS.items():
        wanted = wanted.replace(name, f"speed.{key}")
    return replace(problem, wanted=wanted)


def contradictions(speed: Speed, thrusters: Sequence[Thruster], tables: Mapping[str, Any]) -> Iterator[Problem]:
    """Keys of `[speed]` that need each other or another table, or exclude each other.

    Args:
        speed: the table.
        thrusters: those that are valid.
        tables: the raw file, to tell whether a thruster is missing among them.
    """
    yield from _range_problems(speed)
    if speed.curve is not None and speed.minimum_mps is not None:
        yield Problem(
            "speed.curve", speed.curve, "minimum_mps and maximum_mps say what is normal: remove one of them"
        )
    declared = tables.get("thruster")
    complete = isinstance(declared, list) and len(declared) == len(thrusters)
    if complete and not any(one.ahead for one in thrusters):
        for key in ("curve", "command"):
            if (value := getattr(speed, key)) is not None:
                yield Problem(f"speed.{key}", value, NO_AHEAD)
    if speed.position == "local" and speed.flow is not None and speed.flow.file is not None:
        wanted = 'a forecast needs positions on the earth: want "global", "fix" or "auto"'
        yield Problem("speed.position", speed.position, wanted)


def _range_problems(speed: Speed) -> Iterator[Problem]:
    low_mps, high_mps = speed.minimum_mps, speed.maximum_mps
    if (low_mps is None) != (high_mps is None):
        key = "minimum_mps" if low_mps is None else "maximum_mps"
        yield Problem(f"speed.{key}", None, "missing: want both, or neither where normal speed is to be learnt")
    if low_mps is not None and high_mps is not None and not high_mps > low_mps:
        yield Problem("speed.maximum_mps", high_mps, f"want above minimum_mps = {low_mps:g}")
    if speed.command is not None and low_mps is None and high_mps is None:
        wanted = "means nothing without minimum_mps and maximum_mps, the range that belongs to it"
        yield Problem("speed.command", speed.command, wanted)


# what a pair may be of a curve, and what is wanted of those that are not
_PAIRS: Sequence[tuple[Callable[[float, float], bool], str]] = (
    (lambda command, _: abs(command) <= 1, "commands from -1 to 1; percent? 25 % is 0.25"),
    (lambda command, _: command != 0, "commands other than 0, at which every vehicle stands still"),
    (lambda _, speed_mps: abs(speed_mps) <= SPEED_MAX_MPS, f"speeds up to {SPEED_MAX_MPS:g} m/s; m/s?"),
    (lambda command, speed_mps: command * speed_mps > 0, "speeds of the same sign as their commands, and none of 0"),
)


def curve_problems(points: Points) -> list[Problem]:
    """What is wrong with the pairs of a curve; at most one problem, as one mistake shows in many ways."""
    wanted = next((want for allowed, want in _PAIRS if not all(allowed(*point) for point in points)), None)
    if wanted is None and any(left[0] >= right[0] for left, right in pairwise(points)):
        wanted = "rising commands, each once"
    if wanted is None and any(left[1] > right[1] for left, right in pairwise(points)):
        wanted = "speeds that do not fall as commands rise; m/s before the command?"
    if wanted is None:
        return []
    return [Problem("speed.curve", points, f"want [command, m/s] pairs with {wanted}")]
