"""What `gateway commission` learns of navigation sensors in some dives is worth in another one."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import degrees

import numpy as np

from detectors.navigation import NavigationConfig, NavigationDetector
from gateway.commissioning.navigation_course import NavigationCourse, navigation_course
from gateway.commissioning.navigation_learnt import learn, threshold_of
from gateway.commissioning.navigation_watch import Watched, scaled, watched
from gateway.config_sections import Navigation
from hil_tests.bench.navigation_cases import Recorded
from hil_tests.bench.navigation_measure import SLOW_CASES
from hil_tests.bench.navigation_scores import DEFAULT, Alarms, Found, alarms, by_case, found
from hil_tests.bench.navigation_trace import Job, Trace, traces
from hil_tests.processes import results

AS_IT_COMES, COMMISSIONED, WITH_THRESHOLD = "default", "commissioned", "with its threshold"
BEGINNING_S = 100.0
FALSE_ALARMS_PER_HOUR = 0.1


@dataclass(frozen=True, slots=True)
class Foreseen:
    """How well the DVL is foreseen in a dive that nothing was learnt from.

    Attributes:
        settings, dive: names.
        beginning_mps, whole_mps: root mean square of the innovations, of the first `BEGINNING_S` and of all.
        surprise: mean negative log likelihood of a component.
    """

    settings: str
    dive: str
    beginning_mps: float
    whole_mps: float
    surprise: float


@dataclass(frozen=True, slots=True)
class NavigationFigures:
    """Sums.

    Attributes:
        foreseen: of each settings, medians over the dives.
        healthy: of each settings, false alarms. found: by settings, each case.
        shares: of the configured threshold, by dive.
    """

    foreseen: list[Foreseen]
    healthy: dict[str, Alarms]
    found: dict[str, list[Found]]
    shares: dict[str, float]


def judge_navigation(pool: ProcessPoolExecutor, sources: Sequence[Recorded], dives: int) -> NavigationFigures:
    """Learns from all recordings but one, and looks at that one; for so many of them."""
    courses = results([pool.submit(course_of, one, NavigationConfig()) for one in sources], "courses")
    tried = list(range(len(sources)))[:dives]
    taught = {index: learn([*courses[:index], *courses[index + 1 :]]).settings(NavigationConfig()) for index in tried}
    seen = results([pool.submit(watched_of, sources[index], taught[index]) for index in tried], "healthy dives")
    shares = {index: _share(seen, place) for place, index in enumerate(tried)}
    settings: dict[str, dict[int, NavigationConfig]] = {
        AS_IT_COMES: dict.fromkeys(tried, NavigationConfig()),
        COMMISSIONED: taught,
        WITH_THRESHOLD: {
            index: replace(taught[index], false_alarms_per_hour=scaled(taught[index], shares[index]))
            for index in tried
        },
    }
    judged = {name: _judged(pool, sources, every) for name, every in settings.items()}
    after = results([pool.submit(course_of, sources[index], taught[index]) for index in tried], "held out")
    of_default = [courses[index] for index in tried]
    names = [sources[index].name for index in tried]
    return NavigationFigures(
        foreseen=[_median(AS_IT_COMES, names, of_default), _median(COMMISSIONED, names, after)],
        healthy={name: alarms(DEFAULT, _healthy(every)) for name, every in judged.items()},
        found={name: [found(DEFAULT, one) for one in by_case(every).values()] for name, every in judged.items()},
        shares={sources[index].name: share for index, share in shares.items()},
    )


def course_of(source: Recorded, settings: NavigationConfig) -> NavigationCourse:
    """The filter over one recording."""
    data = source.load()
    return navigation_course(data.samples(), _where(source), settings)


def watched_of(source: Recorded, settings: NavigationConfig) -> Watched:
    """The watch over one recording."""
    return watched(source.load().samples(), _where(source), settings)


def _where(source: Recorded) -> Navigation:
    begin = source.load().initial
    place = {"latitude_deg": degrees(begin.latitude_rad), "longitude_deg": degrees(begin.longitude_rad)}
    return Navigation.model_validate(place)


def _share(seen: Sequence[Watched], place: int) -> float:
    """Of the threshold, by the peaks of the other dives."""
    others = [*seen[:place], *seen[place + 1 :]] or list(seen)
    return threshold_of(others, FALSE_ALARMS_PER_HOUR, held_out=True).share


def _judged(
    pool: ProcessPoolExecutor, sources: Sequence[Recorded], settings: dict[int, NavigationConfig]
) -> list[Trace]:
    jobs = [Job(sources[index], SLOW_CASES, one, NavigationDetector, number=index) for index, one in settings.items()]
    return [trace for every in results([pool.submit(traces, job) for job in jobs], "faults") for trace in every]


def _healthy(judged: Sequence[Trace]) -> list[Trace]:
    return [one for one in judged if one.case is None and one.isolate]


def _median(settings: str, names: Sequence[str], courses: Sequence[NavigationCourse]) -> Foreseen:
    rows = np.array([foreseen(one) for one in courses])
    beginning_mps, whole_mps, surprise = np.median(rows, axis=0).tolist()
    return Foreseen(settings, f"{len(names)} dives", beginning_mps, whole_mps, surprise)


def foreseen(course: NavigationCourse) -> tuple[float, float, float]:
    """Root mean squares of the DVL's innovations, of the beginning and of all, and the surprise."""
    squares = (course.dvl.values**2).mean(axis=1)
    first = course.dvl.time_s < course.dvl.time_s[0] + BEGINNING_S
    return float(np.sqrt(squares[first].mean())), float(np.sqrt(squares.mean())), course.dvl.surprise
