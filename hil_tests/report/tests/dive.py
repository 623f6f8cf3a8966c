"""A dive as an outcome, made by hand: thruster 3 is entangled slowly, found, told, and the depth is held."""

from __future__ import annotations

from typing import Any

import numpy as np

from detectors.verdict import Level
from gateway.severity import Severity
from hil_tests.report.outcome import FloatArray, Outcome, Series, Truth
from hil_tests.report.tests.plays import ENTANGLED, START_S, finding, mode, mode_command, play, text

LASTED_S, FOUND_S, FREED_S = 60.0, 27.3, 54.0
EXPECT: tuple[dict[str, Any], ...] = (
    {"finding": {"subject": "thruster 3", "level": "FAULT"}, "within_s": 4.0},
    {"statustext": r"T3 (entangled|blocked)\?", "severity": "CRITICAL", "within_s": 4.0},
    {"command": "hold", "within_s": 5.0},
    {"mode": "ALT_HOLD"},
)
NEVER: tuple[dict[str, Any], ...] = ({"finding": {"at_least": "SUSPECT"}, "before_s": "fault"},)


def _truth(since_s: FloatArray) -> Truth:
    rng = np.random.default_rng(0)
    phase = np.linspace(0.0, 2.0, 8)
    command = 0.35 + 0.25 * np.sin(0.4 * since_s[:, None] + 3.0 * phase) + 0.02 * rng.normal(size=(len(since_s), 8))
    healthy_rpm = 3200.0 * command
    grown = np.clip((since_s - ENTANGLED.at_s) / ENTANGLED.ramp_s, 0.0, 1.0) * (since_s < ENTANGLED.until_s)
    speed_rpm = healthy_rpm.copy()
    speed_rpm[:, 2] *= 1.0 - 0.3 * grown
    yaw_rad = 0.05 * since_s
    through_mps = 0.8 - 0.1 * grown
    north_mps, east_mps = through_mps * np.cos(yaw_rad) + 0.1, through_mps * np.sin(yaw_rad) - 0.2
    step_s = since_s[1] - since_s[0]
    return Truth(
        time_s=START_S + since_s,
        command=command,
        speed_rpm=speed_rpm,
        healthy_rpm=healthy_rpm,
        north_m=np.cumsum(north_mps) * step_s,
        east_m=np.cumsum(east_mps) * step_s,
        down_m=5.0 + np.sin(0.1 * since_s),
        yaw_rad=yaw_rad,
        through_water_mps=through_mps,
        over_ground_mps=np.hypot(north_mps, east_mps),
        current_north_mps=np.full_like(since_s, 0.1),
        current_east_mps=np.full_like(since_s, -0.2),
        supply_v=16.4 - 0.01 * since_s - 0.3 * command.mean(axis=1),
    )


def _scores(since_s: FloatArray) -> dict[str, Series]:
    rng = np.random.default_rng(1)

    def series(value: FloatArray) -> Series:
        return Series(START_S + since_s, value)

    quiet = np.abs(rng.normal(0.15, 0.06, size=(len(since_s), 12)))
    scores = {f"T{number}": series(quiet[:, number]) for number in range(1, 9)}
    grown = np.clip((since_s - ENTANGLED.at_s) / ENTANGLED.ramp_s, 0.0, 1.0) * (since_s < ENTANGLED.until_s)
    scores["T3"] = series(quiet[:, 3] + 6.0 * grown)
    scores["T3RES"] = series(-400.0 * grown + rng.normal(0.0, 8.0, size=len(since_s)))
    scores["STW"] = series(0.8 - 0.1 * grown + rng.normal(0.0, 0.02, size=len(since_s)))
    scores["SPDF"] = series(quiet[:, 9] + 0.5 * grown)
    scores |= {"NAVF": series(quiet[:, 10]), "DVLF": series(0.7 * quiet[:, 10])}
    return scores


def dive(*, simulated: bool = True, **came: Any) -> Outcome:
    """The dive; `came` replaces fields of the outcome or arguments of `play`."""
    since_s = np.arange(0.0, LASTED_S, 0.1)
    thrusters = [f"thruster {number}" for number in range(1, 9)]
    findings = [
        *(finding(0.1, Level.UNKNOWN, subject, "learning") for subject in thrusters),
        *(finding(8.0 + 0.3 * index, Level.NORMAL, subject, "normal") for index, subject in enumerate(thrusters)),
        finding(12.0, Level.NORMAL, "vehicle", "Speed 0.80 m/s, normal", detector="speed"),
        finding(26.4, Level.SUSPECT, text="T3 entangled? 1310 rpm, want 1405 (-7%)"),
        finding(FOUND_S, text="T3 entangled? 1180 rpm, want 1502 (-21%)"),
        finding(FOUND_S, Level.SUSPECT, "vehicle", "Hold asked for T3", detector="failsafe"),
        finding(FREED_S, Level.NORMAL, text="T3 normal again"),
    ]
    told = [
        text(27.36, "T3 entangled? 1180 rpm, want 1502 (-21%)"),
        text(28.1, "Hold done for T3"),
        text(FREED_S + 0.05, "T3 normal again", Severity.NOTICE),
    ]
    fields: dict[str, Any] = {
        "expect": EXPECT,
        "never": NEVER,
        "findings": findings,
        "texts": told,
        "commands": [mode_command(27.35, 2)],
        "modes": [mode(0.0, "MANUAL"), mode(27.4, "ALT_HOLD")],
        "scores": _scores(since_s),
        "truth": _truth(since_s) if simulated else None,
        "wire_counts": {"can0": {"frames": 24_000}, "mavlink": {}},
        "gateway_lines": ["ran for 60.0 s, judging at most 0.1 s behind", "received: can0 24000, mavlink 3100"],
    }
    return play(lasted_s=LASTED_S, **(fields | came))
