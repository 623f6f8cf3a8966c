"""A telemetry with something of everything, for tests of what is shown."""

from __future__ import annotations

from dataclasses import replace
from math import nan

from detectors.verdict import Level
from gateway.severity import Severity
from gateway.telemetry import LinkTelemetry, Said, SubjectTelemetry, Telemetry

BEGIN_S = 1_700_000_000.0
ENTANGLED = "T3 entangled? 743 rpm, want 1060 (-30%)"


def thruster(
    number: int, level: Level = Level.NORMAL, residual_rpm: float = -20.0, text: str = ""
) -> SubjectTelemetry:
    values = {
        "command": 0.52,
        "speed_rpm": 1060.0 + residual_rpm,
        "predicted_rpm": 1060.0,
        "residual_rpm": residual_rpm,
        "threshold_rpm": 100.0,
        "current_a": 3.2,
    }
    return SubjectTelemetry(f"thruster {number}", level, abs(residual_rpm) / 100.0, values, text)


def vehicle(level: Level = Level.NORMAL) -> SubjectTelemetry:
    values = {
        "speed_mps": 1.1,
        "speed_min_mps": 0.8,
        "speed_max_mps": 1.2,
        "flow_north_mps": 0.0,
        "flow_east_mps": 0.4,
    }
    return SubjectTelemetry("vehicle", level, 0.3, values)


def telemetry(*others: SubjectTelemetry, fault: bool = True, since_s: float = 60.0, **changed: object) -> Telemetry:
    third = thruster(3, Level.FAULT, -317.0, ENTANGLED) if fault else thruster(3)
    subjects = (
        *(thruster(number) for number in (1, 2)),
        third,
        vehicle(),
        SubjectTelemetry("dvl", Level.UNKNOWN, nan, text="never heard"),
        SubjectTelemetry("link can0", Level.NORMAL, nan),
        *(SubjectTelemetry(f"thruster {number} esc", Level.NORMAL, nan) for number in (1, 2, 3)),
        *others,
    )
    texts = [Said(since_s, Severity.INFO, "Watching 3 thrusters"), Said(3.0, Severity.CRITICAL, ENTANGLED)]
    whole = Telemetry(
        time_s=BEGIN_S + since_s,
        vehicle="Test vehicle",
        running_s=since_s,
        subjects=subjects,
        links=(
            LinkTelemetry("can0", True, "", round(100 * since_s), {"overrun": 3, "bad transfer": 0}, 0.42),
            LinkTelemetry("mavlink", None, "", 7, {}, nan),
        ),
        texts=tuple(texts if fault else texts[:1]),
        findings={"FAULT": 1, "NORMAL": 4} if fault else {},
        drops={"pipeline": {"late": 2}},
        behind_s=0.2,
        recording="recording to dive_001.mcap, 12.3 MB",
    )
    return replace(whole, **changed)
