"""What the navigation watch needs of healthy dives: mounting and delay of the DVL, noises, and its threshold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from detectors.navigation import NavigationConfig, NavigationSample
from gateway.commissioning.dive import RecordedDive
from gateway.commissioning.health import faulty_dives
from gateway.commissioning.navigation_course import NavigationCourse, navigation_course
from gateway.commissioning.navigation_figures import navigation_figures
from gateway.commissioning.navigation_learnt import learn, threshold_of
from gateway.commissioning.navigation_missing import missing
from gateway.commissioning.navigation_watch import Watched, watched
from gateway.commissioning.navigation_words import quantities_of, remarks_of, settings_of, threshold_quantities
from gateway.commissioning.part import Part
from gateway.config import Config
from gateway.config_sections import Navigation

SUBJECT = "navigation"

Progress = Callable[[str], None]
Dives = Sequence[Sequence[NavigationSample]]


def commission_navigation(
    config: Config,
    dives: Sequence[RecordedDive],
    false_alarms_per_hour: float,
    vouched: bool = False,
    progress: Progress = lambda *_: None,
) -> Part:
    """The settings of `[navigation]` and `[detector.navigation]` that these healthy dives support.

    Args:
        config: that they were read by; with `[navigation]`.
        dives: with samples of their navigation sensors.
        false_alarms_per_hour: that are wanted.
        vouched: the user says that they are healthy, whatever was found in them.
        progress: hears what is being done.

    Raises:
        ValueError: the configuration has no `[navigation]`, or the wanted rate is not above 0.
    """
    navigation, settings = config.navigation, config.detector.navigation
    if navigation is None or settings is None:
        raise ValueError("no [navigation] in the configuration: want the table, it may be empty")
    if not false_alarms_per_hour > 0.0:
        raise ValueError(f"false_alarms_per_hour = {false_alarms_per_hour}: want above 0")
    if not vouched and (faults := faulty_dives("navigation", dives)):
        return Part(SUBJECT, missing=faults)
    samples = [dive.motion for dive in dives if dive.motion]
    courses = [
        navigation_course(one, navigation, settings) for one in _told(samples, "looking at the sensors", progress)
    ]
    lacking = missing(courses, navigation)
    learnt = learn(courses)
    if lacking:
        figures = navigation_figures(courses, learnt.noise, [], 1.0)
        return Part(SUBJECT, quantities=tuple(quantities_of(learnt)), missing=lacking, figures=figures)
    seen = _watched(samples, courses, navigation, settings, progress)
    threshold = threshold_of(seen, false_alarms_per_hour, held_out=len(courses) > 1)
    return Part(
        SUBJECT,
        settings=tuple(settings_of(learnt, settings, threshold)),
        quantities=(*quantities_of(learnt), *threshold_quantities(threshold)),
        remarks=tuple(remarks_of(learnt, threshold)),
        figures=navigation_figures(courses, learnt.noise, seen, threshold.share),
    )


def _watched(
    samples: Dives,
    courses: Sequence[NavigationCourse],
    navigation: Navigation,
    settings: NavigationConfig,
    progress: Progress,
) -> list[Watched]:
    """Each dive with what the others have taught; of one alone, with its own."""
    seen = []
    for index, one in enumerate(_told(samples, "looking for the threshold", progress)):
        others = [*courses[:index], *courses[index + 1 :]] or courses
        taught = learn(others).settings(settings)
        seen.append(watched(one, navigation, taught))
    return seen


def _told(samples: Dives, what: str, progress: Progress) -> Iterator[Sequence[NavigationSample]]:
    for number, one in enumerate(samples, start=1):
        progress(f"{what}, dive {number} of {len(samples)}")
        yield one
