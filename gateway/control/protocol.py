"""What is said over the control socket: a line of JSON asks, a line of JSON answers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from drivers.readings import OperatorAct
from gateway.operator import MUTE_MAX_S
from gateway.telemetry import Said, Telemetry
from gateway.telemetry_table import table_of, telemetry_of

LINE_MAX = 16_384  # bytes of a request
ANSWER_MAX = 4_194_304  # bytes
STATUS, WATCH = "status", "watch"
QUESTIONS = (STATUS, WATCH)
ACTS: Mapping[str, OperatorAct] = {act.name.lower(): act for act in OperatorAct}


@dataclass(frozen=True, slots=True)
class Request:
    """What the operator wants.

    Attributes:
        ask: "status", "watch", or one of `ACTS`.
        subjects: as the findings call them, or "all"; of "status" and "watch" none.
        duration_s: for how long ("mute"); 0 = as long as is usual.

    Raises:
        ValueError: anything else.
    """

    ask: str
    subjects: tuple[str, ...] = ()
    duration_s: float = 0.0

    def __post_init__(self) -> None:
        asks = self.ask in QUESTIONS
        if not asks and self.ask not in ACTS:
            raise ValueError(f"ask = {self.ask!r}: want one of {', '.join((*QUESTIONS, *ACTS))}")
        if asks == bool(self.subjects):
            wanted = "goes without a subject: all are shown" if asks else "wants a subject, or all"
            raise ValueError(f"{self.ask} {wanted}")
        if not (isfinite(self.duration_s) and 0.0 <= self.duration_s <= MUTE_MAX_S):
            raise ValueError(f"duration_s = {self.duration_s}: want 0 to {MUTE_MAX_S:.0f} s")

    def line(self) -> bytes:
        """For the socket."""
        return _line({"ask": self.ask, "subjects": list(self.subjects), "duration_s": self.duration_s})

    @classmethod
    def parse(cls, line: bytes) -> Request:
        """Reads what came over the socket.

        Raises:
            ValueError: it is no request.
        """
        table = _table(line)
        unknown = sorted(set(table) - {"ask", "subjects", "duration_s"})
        if unknown:
            raise ValueError(f"unknown: {', '.join(unknown)}; want ask, subjects, duration_s")
        ask, subjects, duration_s = table.get("ask"), table.get("subjects", []), table.get("duration_s", 0.0)
        if not isinstance(ask, str):
            raise ValueError(f"ask = {ask!r}: want a word")
        if not (isinstance(subjects, list) and all(isinstance(one, str) for one in subjects)):
            raise ValueError("subjects: want a list of words")
        if isinstance(duration_s, bool) or not isinstance(duration_s, int | float):
            raise ValueError(f"duration_s = {duration_s!r}: want a number")
        return cls(ask, tuple(subjects), _seconds(duration_s))


@dataclass(frozen=True, slots=True)
class Answer:
    """What the gateway answers.

    Attributes:
        ok: it was done.
        lines: what was done, or why not.
        levels: of "status": the level of every subject.
        texts: of "status": the newest texts, the last one last.
        telemetry: of "watch".
    """

    ok: bool
    lines: tuple[str, ...] = ()
    levels: Mapping[str, str] = field(default_factory=dict)
    texts: tuple[Said, ...] = ()
    telemetry: Telemetry | None = None

    def line(self) -> bytes:
        """For the socket."""
        texts = [{"age_s": one.age_s, "severity": one.severity, "text": one.text} for one in self.texts]
        table = {"ok": self.ok, "lines": list(self.lines), "levels": dict(self.levels), "texts": texts}
        return _line(table if self.telemetry is None else {**table, "telemetry": table_of(self.telemetry)})

    @classmethod
    def parse(cls, line: bytes) -> Answer:
        """Reads what came over the socket.

        Raises:
            ValueError: it is no answer.
        """
        table = _table(line)
        try:
            return cls(
                ok=bool(table["ok"]),
                lines=tuple(map(str, table["lines"])),
                levels={str(subject): str(level) for subject, level in table["levels"].items()},
                texts=tuple(Said(float(o["age_s"]), int(o["severity"]), str(o["text"])) for o in table["texts"]),
                telemetry=telemetry_of(table["telemetry"]) if "telemetry" in table else None,
            )
        except (LookupError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError(f"no answer of a gateway: {error!r}") from error


def _line(table: Mapping[str, Any]) -> bytes:
    return json.dumps(table).encode() + b"\n"


def _table(line: bytes) -> dict[str, Any]:
    try:
        table = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"no JSON: {error}") from error
    if not isinstance(table, dict):
        raise ValueError(f"a {type(table).__name__}: want a JSON object")
    return table


def _seconds(value: int | float) -> float:
    try:
        return float(value)
    except OverflowError as error:
        raise ValueError("duration_s: too large") from error
