"""A watch as lines of text, one for each change: for a file, a pipe, or a terminal that can do no more."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf, isfinite

from detectors.verdict import Level
from gateway.telemetry import LinkTelemetry, Said, SubjectTelemetry, Telemetry
from gateway.watch.rows import RANKS
from gateway.watch.source import Look, Source
from gateway.watch.view import headline, state_word
from gateway.watch.words import counted, listed, printable, severity_word, short

# of texts that were seen before: their times are found from ages, and those are rounded
SAME_S = 1e-3
_NUMBER = re.compile(r"\d+([.,:]\d+)*")


def changes(source: Source, wait: Callable[[], None]) -> Iterator[str]:
    """The lines of all looks, until there is nothing more to see; `wait`: for the next look to be due."""
    seen = Changes()
    while True:
        look = source.look()
        yield from seen.take(look)
        if look.ended:
            return
        wait()


class Changes:
    """One look after the other in, what has changed since the last one out."""

    def __init__(self) -> None:
        self._state = ""
        self._levels: dict[str, Level] = {}
        self._links: dict[str, bool | None] = {}
        self._causes: set[tuple[str, str]] = set()
        self._said_s = -inf
        self._begun = False
        self._recording = ""

    def take(self, look: Look) -> list[str]:
        """The lines of a look, each with its time."""
        return [printable(f"{look.time}  {line}") for line in self._lines(look)]

    def _lines(self, look: Look) -> Iterator[str]:
        """What is new of where it comes from goes first; but the end comes last."""
        state = [look.state] if look.state != self._state else []
        self._state = look.state
        if not look.ended:
            yield from state
        if look.telemetry is not None and look.fresh:
            yield from self._changed(look.telemetry)
        if look.ended:
            yield from state

    def _changed(self, telemetry: Telemetry) -> Iterator[str]:
        if not self._begun:
            self._begun = True
            yield headline(telemetry)
        yield from self._subjects(telemetry.subjects)
        for link in telemetry.links:
            yield from self._link(link)
        for stage, drops in telemetry.drops.items():
            if self._new_causes(stage, drops):
                yield f"dropped at {stage}: {counted(drops)}"
        if _kind(telemetry.recording) != _kind(self._recording):
            yield telemetry.recording or "nothing is recorded"
        self._recording = telemetry.recording
        yield from self._texts(telemetry)

    def _subjects(self, subjects: Sequence[SubjectTelemetry]) -> Iterator[str]:
        """What is wrong, subject by subject; the rest together, for at the beginning that is all of them."""
        changed = [one for one in subjects if self._levels.get(one.subject) is not one.level]
        self._levels |= {one.subject: one.level for one in changed}
        for level in RANKS:
            of_level = [one for one in changed if one.level is level]
            if level in (Level.FAULT, Level.SUSPECT):
                yield from map(_wrong, of_level)
            elif of_level:
                yield f"{level.name:7} {listed(one.subject for one in of_level)}"

    def _link(self, link: LinkTelemetry) -> Iterator[str]:
        known, self._links[link.name] = self._links.get(link.name), link.up
        if known is not link.up:
            yield "  ".join(filter(None, (f"link {link.name} {state_word(link.up)}", link.detail)))
        if self._new_causes(f"link {link.name}", link.drops):
            yield f"link {link.name} dropped: {counted(link.drops)}"

    def _new_causes(self, place: str, drops: Mapping[str, int]) -> bool:
        """Whether something is dropped for a cause that was not seen there before."""
        new = {(place, cause) for cause, count in drops.items() if count} - self._causes
        self._causes |= new
        return bool(new)

    def _texts(self, telemetry: Telemetry) -> Iterator[str]:
        before_s = self._said_s
        for said in telemetry.texts:
            said_s = telemetry.time_s - said.age_s
            if said_s > before_s + SAME_S:
                self._said_s = max(self._said_s, said_s)
                yield _told(said)


def _wrong(one: SubjectTelemetry) -> str:
    score = f"score {one.score:.2f}" if isfinite(one.score) else ""
    return "  ".join(filter(None, (f"{one.level.name:7} {short(one.subject)}", score, one.text)))


def _told(said: Said) -> str:
    return f"{severity_word(said.severity)}: {said.text}"


def _kind(words: str) -> str:
    """Words without their numbers: that something goes on growing is no change."""
    return _NUMBER.sub("#", words)
