"""How a demonstration went: what was found and told when, and what was not true."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan

from hil_tests.demo.record import WARNING, Recording, Trouble, Truth, names
from hil_tests.rig.commands import Command
from hil_tests.rig.notes import Notes, ReceivedText


@dataclass(frozen=True, slots=True)
class Found:
    """What came of one trouble. Times in seconds; NaN where something did not happen.

    Attributes:
        trouble: which.
        verdict_s: first FAULT from its onset on.
        text_s: first alarm about it at the autopilot.
    """

    trouble: Trouble
    verdict_s: float
    text_s: float

    @property
    def latency_s(self) -> float:
        """From its first sign to the STATUSTEXT at the autopilot."""
        return self.text_s - self.trouble.shown_s


@dataclass(frozen=True, slots=True)
class Summary:
    """How a demonstration went.

    Attributes:
        lasted_s: how long it ran.
        found: what came of every trouble.
        command_s: failsafe message at the autopilot; NaN: none.
        position_errors_m: at the end, of the detector that isolates a faulty sensor and of one that does not; NaN
            where there was no such fault.
        false_alarms: alarms at the autopilot, and verdicts of FAULT, that were not true.
        left_out: what there was no time to show.
        counts: frames, samples, drops and the like, by name.
        judged_late_s: how long after its own time a sample was judged, at worst: the machine's margin.
        load: processor time over time, 1.0 = one core.
    """

    lasted_s: float
    found: tuple[Found, ...]
    command_s: float
    false_alarms: tuple[str, ...]
    left_out: tuple[str, ...]
    counts: Mapping[str, int]
    judged_late_s: float
    load: float
    position_errors_m: tuple[float, float] = (nan, nan)

    @property
    def passed(self) -> bool:
        """The pilot was told of every trouble, and of nothing that was not there."""
        return all(isfinite(one.text_s) for one in self.found) and not self.false_alarms


# That this machine is too busy is true, and no alarm about the vehicle.
ABOUT_ITSELF = "Gateway "


def summarize(
    recording: Recording,
    notes: Notes,
    truth: Truth,
    *,
    lasted_s: float,
    counts: Mapping[str, int],
    load: float,
    left_out: Sequence[str] = (),
    position_errors_m: tuple[float, float] = (nan, nan),
) -> Summary:
    """Judge a demonstration by what reached the autopilot."""
    alarms = [text for text in notes.texts if text.severity <= WARNING and not text.text.startswith(ABOUT_ITSELF)]
    actions = (one.time_s for one in notes.commands if one.command in set(Command))
    return Summary(
        lasted_s=lasted_s,
        found=tuple(_found(recording, alarms, trouble) for trouble in truth.troubles),
        command_s=next(actions, nan),
        false_alarms=tuple(_false_alarms(recording, alarms, truth)),
        left_out=tuple(left_out),
        counts=dict(counts),
        judged_late_s=recording.latest_s,
        load=load,
        position_errors_m=position_errors_m,
    )


def _found(recording: Recording, alarms: Iterable[ReceivedText], trouble: Trouble) -> Found:
    verdict_s = recording.first_fault_s(trouble.subject, trouble.onset_s)
    text_s = next((text.time_s for text in alarms if trouble.explains(text)), nan)
    return Found(trouble, verdict_s, text_s)


def _false_alarms(recording: Recording, alarms: Sequence[ReceivedText], truth: Truth) -> Iterable[str]:
    for text in alarms:
        if not any(trouble.explains(text) for trouble in truth.troubles):
            yield f'STATUSTEXT "{text.text}"'
    onsets_s = {trouble.subject: trouble.onset_s for trouble in truth.troubles}
    for subject in recording.subjects():
        false_s = recording.first_fault_s(subject, -inf)
        if false_s < onsets_s.get(subject, inf) and not any(names(text.text, subject) for text in alarms):
            yield f"FAULT of {subject}, not told"


def summary_lines(summary: Summary, start_s: float) -> list[tuple[str, str]]:
    """What came of it, in pairs of a name and a value.

    Args:
        summary: of the demonstration.
        start_s: what its times count from.
    """
    lines = [line for found in summary.found for line in _found_lines(found, start_s)]
    lines.append(("first failsafe message at the autopilot", _at(summary.command_s, start_s)))
    lines += _position_lines(*summary.position_errors_m)
    if summary.left_out:
        lines.append(("no time for", "; ".join(summary.left_out)))
    lines.append(("false alarms", _listed(summary.false_alarms)))
    lines += [(what, f"{count}") for what, count in summary.counts.items()]
    lines.append(("judged at most", f"{summary.judged_late_s:.2f} s late"))
    lines.append(("processor load of all", f"{100.0 * summary.load:.0f} % of one core"))
    lines.append(("result", "passed" if summary.passed else "FAILED"))
    return lines


def _position_lines(with_isolation_m: float, without_m: float) -> Iterable[tuple[str, str]]:
    if isfinite(with_isolation_m):
        yield (
            "position error since the drift set in",
            f"{with_isolation_m:.1f} m; {without_m:.1f} m without isolation",
        )


def _found_lines(found: Found, start_s: float) -> Iterable[tuple[str, str]]:
    trouble = found.trouble
    if trouble.shown_s != trouble.onset_s:
        yield trouble.catches, _at(trouble.onset_s, start_s)
    yield trouble.shows, _at(trouble.shown_s, start_s)
    yield f"{trouble.subject}: detector says FAULT", _at(found.verdict_s, start_s)
    yield f"{trouble.subject}: STATUSTEXT at the autopilot", _at(found.text_s, start_s)
    latency = f"{found.latency_s:.2f} s" if isfinite(found.latency_s) else "-"
    yield f"{trouble.subject}: from first sign to STATUSTEXT", latency


def _listed(alarms: Sequence[str]) -> str:
    return f"{len(alarms)}: {'; '.join(alarms)}" if alarms else "none"


def _at(time_s: float, start_s: float) -> str:
    return f"at {time_s - start_s:.2f} s" if isfinite(time_s) else "never"
