"""What is said of a thruster that was learnt: how it answers and how sure that is, what is missing, what is odd."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gateway.commissioning.dive import RecordedDive
from gateway.commissioning.excitation import Excitation
from gateway.commissioning.part import Quantity
from gateway.commissioning.thruster_response import Known, ThrusterResponse
from gateway.config_sections import Thruster

DIFFERS_MAX = 0.06  # speed of one dive against that of all: a healthy thruster repeats itself better than that
DOUBT_MAX = 0.03  # of the curve, relative


def missing(driven: Excitation, answer: ThrusterResponse | None, dives: Sequence[RecordedDive]) -> Iterator[str]:
    """What is missing in its dives."""
    yield from driven.missing()
    if answer is None:
        yield "no model of it can be learnt: its speed does not follow its command, or it was driven for too short"
        return
    yield from _differing(answer, dives)
    doubt = answer.curve.relative_error()
    if doubt > DOUBT_MAX:
        yield f"its curve is known to {doubt:.1%} only: drive for some minutes, with commands held for some seconds"


def _differing(answer: ThrusterResponse, dives: Sequence[RecordedDive]) -> Iterator[str]:
    """Dives in which it was another thruster than in the rest: which of them is wrong, nobody knows."""
    for dive, gain in zip(dives, answer.gains, strict=True):
        if len(dives) > 1 and abs(gain) > DIFFERS_MAX:
            yield (
                f"in {dive.name} it is {abs(gain):.0%} {'faster' if gain > 0 else 'slower'} at the same command than"
                " in all dives together: is one of another vehicle, of another propeller, or not healthy?"
            )


def quantities(driven: Excitation, answer: ThrusterResponse | None) -> Iterator[Quantity]:
    """What was measured."""
    reach = f"{-driven.astern or 0.0:+.0%} to {driven.ahead:+.0%}"
    yield Quantity("commanded", reach, f"{driven.driven_s:.0f} s beyond idle, {driven.steps} fast changes")
    if answer is None:
        return
    curve = answer.curve
    top, plural = int(np.argmax(np.abs(curve.speed_rpm))), "" if answer.stretches == 1 else "es"
    supply = f" at {curve.supply_v:.1f} V" if np.isfinite(curve.supply_v) else ""
    yield Quantity(
        "steady speed",
        f"{curve.speed_rpm[top]:.0f} rpm at {curve.command[top]:+.0%}{supply}",
        f"+-{curve.relative_error():.1%}, from {answer.stretches} stretch{plural}",
    )
    yield Quantity("delay", *_seconds(answer.delay_s))
    yield Quantity("lag", *_seconds(answer.lag_s))
    yield Quantity("noise of the speed", f"{answer.noise_rpm.value:.1f} rpm", _range(answer.noise_rpm, ".1f"))
    if np.isfinite(curve.supply_v):
        yield Quantity("speed follows voltage", f"{curve.supply_exponent:.2f} % a percent")
    if len(known := [gain for gain in answer.gains if np.isfinite(gain)]) > 1:
        yield Quantity("from dive to dive", f"{min(known):+.1%} to {max(known):+.1%}", f"{len(known)} dives")


def remarks(
    thruster: Thruster, driven: Excitation, answer: ThrusterResponse | None, rate_hz: float, others: Sequence[str]
) -> Iterator[str]:
    """What else the user should know."""
    if others:
        yield f"not used, for its samples do not come at {rate_hz:g} Hz there: {', '.join(others)}"
    for way, reach in (("ahead", driven.ahead), ("astern", driven.astern)):
        if reach == 0.0:
            yield f"it was never driven {way}: there, it is UNKNOWN until it has learnt that while diving"
    if answer is not None and answer.unsigned and driven.astern > 0.0 and thruster.rpm.signed is not False:
        yield "its speed was never negative, though it was driven astern: add signed = false to its rpm"
    if answer is not None and _backwards(answer):
        yield "its speed is negative where its command is positive: add reverse = true to its command or to its rpm"


def _backwards(answer: ThrusterResponse) -> bool:
    return bool(np.median(np.sign(answer.curve.speed_rpm) * np.sign(answer.curve.command)) < 0.0)


def _seconds(known: Known) -> tuple[str, str]:
    return f"{known.value:.3f} s", _range(known, ".3f")


def _range(known: Known, digits: str) -> str:
    return f"{known.low:{digits}} to {known.high:{digits}} in the stretches" if known.high > known.low else ""
