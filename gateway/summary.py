"""What a run of the gateway came to, in lines for its log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from detectors.verdict import Level


@dataclass(slots=True)
class Summary:
    """What a run came to.

    Attributes:
        duration_s: from start to stop.
        behind_max_s: the longest that readings waited to be judged.
        frames: received, by link (of MAVLink: readings).
        drops: what was thrown away, by link or stage, by cause.
        findings: number of findings by their level.
        levels: last level of every subject.
        remarks: on subjects, beside their levels.
        unjudged: subjects of which there was never a sample.
    """

    duration_s: float = 0.0
    behind_max_s: float = 0.0
    frames: Counter[str] = field(default_factory=Counter)
    drops: dict[str, Counter[str]] = field(default_factory=dict)
    findings: Counter[str] = field(default_factory=Counter)
    levels: dict[str, Level] = field(default_factory=dict)
    remarks: dict[str, str] = field(default_factory=dict)
    unjudged: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        """For the log."""
        return [
            f"ran for {self.duration_s:.1f} s, judging at most {self.behind_max_s:.1f} s behind",
            f"received: {listed(self.frames)}",
            *(f"dropped at {place}: {listed(causes)}" for place, causes in self.drops.items() if causes),
            f"findings: {listed(self.findings)}",
            f"levels: {worst_first(self.levels, self.unjudged)}",
            *(f"{subject}: {remark}" for subject, remark in self.remarks.items()),
            *([f"never judged: {', '.join(self.unjudged)}"] if self.unjudged else []),
        ]


def worst_first(levels: Mapping[str, Level], unjudged: Collection[str] = ()) -> str:
    """The subjects that are not NORMAL, by name: what is well need not be listed.

    `unjudged`: subjects of which nothing is known, and which are listed elsewhere.
    """
    judged = "judged " if unjudged else ""
    named = [subject for subject, level in levels.items() if level is not Level.NORMAL]
    if not named:
        return f"all {judged}NORMAL" if levels else "none"
    named.sort(key=lambda subject: levels[subject], reverse=True)
    told = ", ".join(f"{subject} {levels[subject].name}" for subject in named)
    return told if len(named) == len(levels) else f"{told}, all others {judged}NORMAL"


def listed(counts: Counter[str]) -> str:
    """What was counted, by name."""
    return ", ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"
