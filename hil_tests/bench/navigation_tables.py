"""The navigation detector's figures as tables for a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from rich import box
from rich.table import Table

from detectors.navigation import Sensor
from hil_tests.bench.navigation_cases import CASES
from hil_tests.bench.navigation_measure import Rate
from hil_tests.bench.navigation_paper import PaperScore
from hil_tests.bench.navigation_scores import Alarms, Found

LABELS = {
    "chi_square": "chi-square",
    "cusum": "CUSUM",
    "lstm": "LSTM",
    "ratio": "ratio",
    "plain chi_square": "chi-square, 16 st.",
    "plain cusum": "CUSUM, 16 st.",
}
PLACES = ("straight:\ntrials", "found", "turn:\ntrials", "found")
PAPER_S = {case.name: dict(case.paper) for case in CASES}


def alarms_table(groups: Mapping[str, Sequence[Alarms]]) -> Table:
    """False alarms on healthy dives, one line for each method and threshold."""
    headings = ("threshold", "dives\nalarmed", "alarms", "alarms\n/ h", "time\n%")
    table = _table("Navigation watch: false alarms on healthy dives, turns included", ("dives", "method"), headings)
    for group, scores in groups.items():
        for number, score in enumerate(scores):
            threshold = "own" if score.scale == 1.0 else f"x {score.scale:.3g}"
            table.add_row(
                group if number == 0 else "",
                label(score.method),
                threshold,
                f"{score.alarmed}/{score.dives}",
                str(score.events),
                f"{score.per_hour:.2g}",
                f"{100.0 * score.share:.2g}",
                end_section=score is scores[-1],
            )
    return table


def found_table(title: str, scores: Sequence[Found]) -> Table:
    """Faults found and time to find, one line for each case, a column for each method, the paper's times beside."""
    methods = list(dict.fromkeys(score.method for score in scores))
    table = _table(
        f"Navigation watch: {title}", ("fault",), ["trials", *map(label, methods), "paper:\nchi/CUSUM/LSTM"]
    )
    for case in dict.fromkeys(score.case for score in scores):
        own = {score.method: score for score in scores if score.case == case}
        cells = [_found(own[method]) if method in own else "-" for method in methods]
        table.add_row(case, str(next(iter(own.values())).trials), *cells, _paper(case))
    return table


def paper_table(scores: Sequence[PaperScore]) -> Table:
    """The paper's protocol, one line for each method and threshold."""
    headings = (
        "threshold",
        "isol.",
        "not\nfound",
        "alarm\nbefore",
        "median\ns",
        "fault\nunseen %",
        "false",
        "sound in\nalarm %",
    )
    table = _table("Paper 003's protocol: 50 s of drift in every 100 s", ("method",), headings)
    for score in scores:
        table.add_row(
            label(score.method),
            "own" if score.scale == 1.0 else f"x {score.scale:.3g}",
            "yes" if score.isolate else "no",
            f"{score.missed}/{score.segments}",
            f"{score.early}/{score.segments}",
            _seconds(score.median_s),
            f"{100.0 * score.missed_share:.0f}",
            f"{score.false_segments}/{score.segments}",
            f"{100.0 * score.false_share:.1f}",
        )
    return table


def named_table(groups: Mapping[str, Mapping[Sensor, Counter[str]]]) -> Table:
    """Which sensor was named first, by the faulty one."""
    said = [*map(str, Sensor), "open", "none"]
    table = _table("Navigation watch: sensor named first, by the faulty one", ("dives", "faulty"), said)
    for group, counts in groups.items():
        for number, (sensor, counter) in enumerate(counts.items()):
            if counter:
                table.add_row(group if number == 0 else "", str(sensor), *(str(counter[name]) for name in said))
    return table


def positions_table(errors_m: Mapping[str, Sequence[tuple[float, float]]]) -> Table:
    """Position errors, last and greatest, of each variant over its dives."""
    headings = ("dives", "at the end\nmedian m", "at the end\nworst m", "greatest\nmedian m")
    table = _table(
        "Navigation watch: horizontal position error, DVL failing five times (figure 14)", ("variant",), headings
    )
    for variant, pairs in errors_m.items():
        last, greatest = (sorted(values) for values in zip(*pairs, strict=True))
        middle = len(pairs) // 2
        table.add_row(
            label(variant), str(len(pairs)), f"{last[middle]:.1f}", f"{last[-1]:.1f}", f"{greatest[middle]:.1f}"
        )
    return table


def places_table(group: str, straight: Sequence[Found], turning: Sequence[Found]) -> Table:
    """What the default found of faults that began on a straight leg, and in a turn."""
    table = _table(f"Navigation watch: {group}, the default by where the fault began", ("fault",), PLACES)
    by_place = [{score.case: score for score in scores} for scores in (straight, turning)]
    for case in dict.fromkeys(score.case for score in (*straight, *turning)):
        cells = [
            cell
            for place in by_place
            for cell in ((str(place[case].trials), _found(place[case])) if case in place else ("0", "-"))
        ]
        table.add_row(case, *cells)
    return table


def rates_table(rates: Sequence[Rate]) -> Table:
    """What remains possible with a slower IMU, of the default method."""
    cases = [score.case for score in rates[0].found]
    table = _table("Navigation watch: rate of the IMU (recordings, averaged)", ("IMU",), ["alarms\n/ h", *cases])
    for rate in rates:
        table.add_row(f"{rate.imu_hz:g} Hz", f"{rate.healthy.per_hour:.2g}", *map(_found, rate.found))
    return table


def label(method: str) -> str:
    """As a reader knows it."""
    return LABELS.get(method, method)


def _table(title: str, names: Sequence[str], headings: Sequence[str]) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name in names:
        table.add_column(name, no_wrap=True)
    for heading in headings:
        table.add_column(heading, justify="right")
    return table


def _found(score: Found) -> str:
    """Share found and median time: 95 % 4.0 s."""
    return f"{100.0 * score.found / score.trials:.0f} % {_seconds(score.median_s)}"


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def _paper(case: str) -> str:
    times_s = PAPER_S.get(case, {})
    return "/".join(f"{times_s[name]:.0f}" for name in ("chi_square", "cusum", "lstm")) if times_s else ""
