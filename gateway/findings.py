"""A finding: something changed its level. One JSON object a line, in a file that survives a crash."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from detectors.verdict import Level
from gateway.severity import Severity

SCORE_DIGITS = 6
TIME_DIGITS = 6


@dataclass(frozen=True, slots=True)
class Finding:
    """A change of level of one subject.

    Attributes:
        time_s: instant of the sample, reading or tick that it follows from.
        detector: who says so: "thruster", "speed", "navigation", "link", "signal", "failsafe", "operator".
        subject: of what: "thruster 3", "thruster 3 esc", "link can0", "vehicle", "dvl".
        level: the new level.
        score: dimensionless evidence, 1.0 = the threshold of a FAULT; NaN where there is none.
        text: in words, as the pilot gets it.
        severity: MAVLink severity of the text.
    """

    time_s: float
    detector: str
    subject: str
    level: Level
    score: float
    text: str
    severity: Severity

    def json_line(self) -> str:
        """One line of `findings.jsonl`, without its end: the same finding gives the same bytes. No score is null."""
        return json.dumps(
            {
                "time_s": round(self.time_s, TIME_DIGITS),
                "detector": self.detector,
                "subject": self.subject,
                "level": self.level.name,
                "score": round(self.score, SCORE_DIGITS) if math.isfinite(self.score) else None,
                "text": self.text,
                "severity": self.severity.name,
            },
            ensure_ascii=False,
        )

    @classmethod
    def of_json_line(cls, line: str) -> Finding:
        """The finding of such a line, as exact as it was written.

        Raises:
            ValueError, KeyError: it is none.
        """
        told = json.loads(line)
        return cls(
            time_s=told["time_s"],
            detector=told["detector"],
            subject=told["subject"],
            level=Level[told["level"]],
            score=math.nan if told["score"] is None else told["score"],
            text=told["text"],
            severity=Severity[told["severity"]],
        )


class FindingsFile:
    """Appends findings to a file, each on disk before `append` returns. A line cut off by a crash is closed first.

    Raises:
        OSError: the file cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("ab+", buffering=0)
        if self._ends_inside_a_line():
            self._file.write(b"\n")

    def append(self, finding: Finding) -> None:
        """Writes one line, in one piece."""
        self._file.write(finding.json_line().encode() + b"\n")
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ends_inside_a_line(self) -> bool:
        if self._file.seek(0, os.SEEK_END) == 0:
            return False
        self._file.seek(-1, os.SEEK_END)
        return self._file.read(1) != b"\n"
