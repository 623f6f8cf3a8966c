"""How a running gateway is, at one instant: what `gateway watch` shows and what Prometheus is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from detectors.verdict import Level


@dataclass(frozen=True, slots=True)
class Said:
    """A text that the pilot was told.

    Attributes:
        age_s: how long ago.
        severity: MAV_SEVERITY.
        text: as he read it.
    """

    age_s: float
    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class SubjectTelemetry:
    """A subject of the findings.

    Attributes:
        subject: as in the findings.
        level: as the pilot was told.
        score: newest score of its detector, 1.0 = the threshold; NaN where there is none.
        values: what its detector says beside, by name with unit: "command", "speed_rpm", "predicted_rpm",
            "residual_rpm", "threshold_rpm", "speed_mps", ...
        text: newest text about it, or the reason of its level; empty where there is none.
    """

    subject: str
    level: Level
    score: float
    values: Mapping[str, float] = field(default_factory=dict)
    text: str = ""


@dataclass(frozen=True, slots=True)
class LinkTelemetry:
    """A link.

    Attributes:
        name: in the configuration.
        up: None: not known yet.
        detail: why it is down, or what is wrong with it, in a few words; empty where all is well.
        received: frames; of MAVLink, readings.
        drops: what was thrown away, and what was wrong with the bus, by cause.
        load: share of the bit rate, 0 to 1; NaN where it is not known.
        decode_errors: those of `drops` that its decoder threw away.
    """

    name: str
    up: bool | None
    detail: str
    received: int
    drops: Mapping[str, int]
    load: float
    decode_errors: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Refits:
    """How often a detector has learnt its model anew, and how long that took in all."""

    count: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Telemetry:
    """See the module's text.

    Attributes:
        time_s: instant, unix seconds.
        vehicle: name of it.
        running_s: since the start.
        subjects, links: of the configuration, and those that were told of beside.
        texts: the newest texts to the pilot, the last one last.
        findings: so far, by level.
        drops: what was thrown away elsewhere than on a link, by stage, by cause.
        behind_s: how late the judging is.
        latency_bounds_s, latency_counts: (N,) upper bounds and (N + 1,) counts of the time from a sample's instant
            until its judgement was told; the last count is of all beyond.
        latency_sum_s: of all of them.
        refits: by subject.
        recording: how recording goes, in words; empty: nothing is recorded.
        recorded_bytes: that are on disk by now; None: nothing is recorded.

    Raises:
        ValueError: counts and bounds that do not go together.
    """

    time_s: float
    vehicle: str
    running_s: float
    subjects: tuple[SubjectTelemetry, ...] = ()
    links: tuple[LinkTelemetry, ...] = ()
    texts: tuple[Said, ...] = ()
    findings: Mapping[str, int] = field(default_factory=dict)
    drops: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    behind_s: float = 0.0
    latency_bounds_s: tuple[float, ...] = ()
    latency_counts: tuple[int, ...] = ()
    latency_sum_s: float = 0.0
    refits: Mapping[str, Refits] = field(default_factory=dict)
    recording: str = ""
    recorded_bytes: int | None = None

    def __post_init__(self) -> None:
        bounds, counts = self.latency_bounds_s, self.latency_counts
        if counts and len(counts) != len(bounds) + 1:
            raise ValueError(
                f"{len(counts)} latency_counts for {len(bounds)} latency_bounds_s: want one more, or none"
            )
