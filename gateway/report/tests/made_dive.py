"""A dive made by hand: thruster 3 is entangled and freed, the hull slows down, the DVL drifts and is isolated."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np

from detectors.verdict import Level
from gateway.config import parse
from gateway.findings import Finding
from gateway.plotting.figure import FloatArray
from gateway.replay.result import ReplayResult
from gateway.report.dive import Curve, Dive, LinkCourse, NavigationCourse, SpeedCourse, ThrusterCourse
from gateway.severity import Severity

BEGIN_S, LENGTH_S = 1_700_000_000.0, 600.0
TANGLED_S, FREED_S = 240.0, 300.0
SLOW_S, CLEAN_S = 360.0, 420.0
DRIFT_S, ISOLATED_S = 470.0, 482.0
EXAMPLE = files("gateway") / "examples" / "bluerov2_heavy_dronecan.toml"


def finding(
    since_s: float, level: Level, subject: str, text: str = "", detector: str = "thruster", score: float = 1.2
) -> Finding:
    """One, at a time since the beginning of the dive."""
    severity = {Level.FAULT: Severity.CRITICAL, Level.SUSPECT: Severity.WARNING}.get(level, Severity.INFO)
    return Finding(BEGIN_S + since_s, detector, subject, level, score, text or level.name.lower(), severity)


def findings() -> tuple[Finding, ...]:
    """Of such a dive, in order."""
    thrusters = [f"thruster {number}" for number in range(1, 9)]
    return (
        *(finding(0.5, Level.UNKNOWN, one, "learning") for one in thrusters),
        finding(1.0, Level.UNKNOWN, "vehicle", "learning", "speed"),
        finding(1.0, Level.UNKNOWN, "dvl", "learning", "navigation"),
        finding(1.2, Level.NORMAL, "link can0", "link can0 back", "link"),
        *(finding(12.0 + 0.3 * place, Level.NORMAL, one) for place, one in enumerate(thrusters)),
        finding(20.0, Level.NORMAL, "dvl", "", "navigation"),
        finding(60.0, Level.NORMAL, "vehicle", "Speed 0.80 m/s", "speed"),
        finding(TANGLED_S + 0.4, Level.SUSPECT, "thruster 3", "T3 entangled? 1310 rpm, want 1405 (-7%)"),
        finding(TANGLED_S + 0.9, Level.FAULT, "thruster 3", "T3 entangled? 1180 rpm, want 1502 (-21%)"),
        finding(TANGLED_S + 1.0, Level.SUSPECT, "vehicle", "Hold asked for T3", "failsafe"),
        finding(FREED_S + 2.0, Level.NORMAL, "thruster 3"),
        finding(SLOW_S + 6.0, Level.SUSPECT, "vehicle", "Speed 0.52 m/s, want 0.7-0.9", "speed"),
        finding(SLOW_S + 12.0, Level.FAULT, "vehicle", "Speed 0.41 m/s, want 0.7-0.9", "speed"),
        finding(CLEAN_S + 8.0, Level.NORMAL, "vehicle", "Speed 0.80 m/s", "speed"),
        finding(ISOLATED_S, Level.FAULT, "dvl", "DVL drifts 0.02 m/s/s", "navigation"),
    )


def thruster(number: int, rate_hz: float = 10.0, length_s: float = LENGTH_S) -> ThrusterCourse:
    """One; number 3 is entangled for a minute."""
    rng = np.random.default_rng(number)
    time_s = np.arange(0.0, length_s, 1.0 / rate_hz)
    command = 0.4 + 0.3 * np.sign(np.sin(0.15 * time_s + number)) + 0.1 * np.sin(0.4 * time_s)
    predicted = 3200.0 * command + 6.0 * rng.normal(size=len(time_s))
    tangled = (time_s >= TANGLED_S) & (time_s < FREED_S) & (number == 3)
    speed = predicted * np.where(tangled, 0.8, 1.0) + 12.0 * rng.normal(size=len(time_s))
    learning = time_s < 12.0
    predicted[learning] = np.nan
    score = np.abs(0.15 + 0.05 * rng.normal(size=len(time_s))) + 6.0 * tangled
    level = np.where(learning, Level.UNKNOWN, np.where(score >= 1.0, Level.FAULT, Level.NORMAL))
    axis = np.linspace(-0.1, 0.8, 40)
    return ThrusterCourse(
        number=number,
        name="front left" if number == 3 else f"thruster {number}",
        time_s=time_s,
        command=command,
        speed_rpm=speed,
        predicted_rpm=predicted,
        residual_rpm=speed - predicted,
        threshold_rpm=np.where(learning, np.nan, 60.0 + 40.0 * command),
        score=score,
        level=level.astype(np.int64),
        refit_s=np.array([12.0, 40.0, 95.0, 180.0]),
        curve=Curve(axis, 3150.0 * axis, 20.0 + 60.0 * np.abs(axis - 0.4)),
        commissioned=Curve(axis, 3200.0 * axis, np.full(len(axis), np.nan)),
    )


def speed() -> SpeedCourse:
    """Round and round in a current."""
    rng = np.random.default_rng(0)
    time_s = np.arange(0.0, LENGTH_S, 0.5)
    slow = (time_s >= SLOW_S) & (time_s < CLEAN_S)
    heading_rad = 0.02 * time_s + 0.4 * np.sin(0.05 * time_s)
    true_mps = np.where(slow, 0.4, 0.8)
    flow_mps = np.column_stack((0.12 + 0.0001 * time_s, np.full(len(time_s), -0.2)))
    ground_mps = true_mps[:, None] * np.column_stack((np.cos(heading_rad), np.sin(heading_rad))) + flow_mps
    north_m, east_m = (0.5 * np.cumsum(ground_mps, axis=0)).T
    learning = time_s < 60.0
    level = np.where(learning, Level.UNKNOWN, np.where(slow, Level.FAULT, Level.NORMAL))
    return SpeedCourse(
        time_s=time_s,
        north_m=north_m,
        east_m=east_m,
        down_m=4.0 + 2.0 * np.sin(0.01 * time_s),
        heading_rad=heading_rad,
        speed_mps=true_mps + 0.02 * rng.normal(size=len(time_s)),
        speed_error_mps=np.where(learning, np.inf, 0.03),
        speed_min_mps=np.where(learning, np.nan, 0.65),
        speed_max_mps=np.where(learning, np.nan, 0.95),
        flow_mps=flow_mps + 0.01 * rng.normal(size=flow_mps.shape),
        score=np.abs(0.2 + 0.05 * rng.normal(size=len(time_s))) + 2.0 * slow,
        level=level.astype(np.int64),
    )


def navigation() -> NavigationCourse:
    """The DVL drifts, and is isolated."""
    rng = np.random.default_rng(1)
    time_s = np.arange(0.0, LENGTH_S, 0.25)
    out = time_s >= ISOLATED_S
    innovation = rng.normal(size=(len(time_s), 4)) * np.array([0.02, 0.02, 0.01, 0.03])
    innovation[:, 0] += 0.02 * np.clip(time_s - DRIFT_S, 0.0, None)
    statistic = np.abs(0.3 + 0.1 * rng.normal(size=len(time_s))) + np.clip(0.1 * (time_s - DRIFT_S), 0.0, 9.0)
    heading_rad = 0.02 * time_s
    return NavigationCourse(
        time_s=time_s,
        innovation=innovation,
        statistics={"ratio": statistic, "chi_square": 0.6 * statistic},
        north_m=40.0 * np.sin(heading_rad),
        east_m=40.0 - 40.0 * np.cos(heading_rad),
        depth_m=4.0 + 2.0 * np.sin(0.01 * time_s),
        position_error_m=0.5 + 0.002 * time_s + 0.05 * np.clip(time_s - ISOLATED_S, 0.0, None),
        levels={
            "dvl": np.where(out, Level.FAULT, Level.NORMAL).astype(np.int64),
            "depth sensor": np.full(len(time_s), int(Level.NORMAL)),
        },
        isolated={"dvl": out, "depth sensor": np.zeros(len(time_s), dtype=bool)},
    )


def links() -> tuple[LinkCourse, ...]:
    """A bus that is down for a while, and MAVLink."""
    rng = np.random.default_rng(2)
    time_s = np.arange(0.0, LENGTH_S)
    down = (time_s >= 100.0) & (time_s < 112.0)
    lost = np.where(down | (time_s % 97.0 < 1.0), 3.0, 0.0)
    nothing, unknown = np.zeros(len(time_s)), np.full(len(time_s), np.nan)
    buses = LinkCourse(
        "can0",
        time_s,
        np.where(down, 0.0, 800.0 + 20.0 * rng.normal(size=len(time_s))),
        np.where(down, 0.0, 0.31 + 0.01 * rng.normal(size=len(time_s))),
        lost,
        np.array([[100.0, 112.0]]),
    )
    mavlink = LinkCourse(
        "mavlink", time_s, 120.0 + 5.0 * rng.normal(size=len(time_s)), unknown, nothing, np.empty((0, 2))
    )
    return buses, mavlink


def dive(**other: Any) -> Dive:
    """All of it; `other` replaces parts."""
    text = EXAMPLE.read_text()
    whole: FloatArray = np.array([[5.0, 590.0]])
    parts: dict[str, Any] = {
        "config": parse(text, folder=EXAMPLE.parent),  # type: ignore[arg-type]
        "config_text": text,
        "result": ReplayResult(begin_s=BEGIN_S, end_s=BEGIN_S + LENGTH_S, duration_s=LENGTH_S, judged=True),
        "begin_s": BEGIN_S,
        "end_s": BEGIN_S + LENGTH_S,
        "findings": findings(),
        "logs": ("dive.mcap",),
        "versions": {"gateway": "0.1.0"},
        "thrusters": tuple(thruster(number) for number in range(1, 9)),
        "speed": speed(),
        "navigation": navigation(),
        "links": links(),
        "armed": whole,
        "modes": ((0.0, "MANUAL"), (30.0, "ALT_HOLD"), (TANGLED_S + 2.0, "POSHOLD"), (FREED_S + 5.0, "ALT_HOLD")),
    }
    return Dive(**(parts | other))
