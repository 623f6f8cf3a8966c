"""Whether a scenario and its vehicle go together: thrusters, buses and modes that it speaks of are there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory
from tomllib import TOMLDecodeError
from typing import Any

from gateway.config import Config
from gateway.problems import ConfigError, Problem, is_file
from hil_tests.dive_logs.reading import located
from hil_tests.playback.settings import config_text, in_memory, write_config
from hil_tests.profiles import Profile, load_profile, profile_names
from hil_tests.rig import ardusub, px4
from hil_tests.scenario.consistency import Contradiction, places_of_faults
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.failures import Target
from hil_tests.scenario.loading import entries_in, loaded
from hil_tests.yaml_document import DocumentError, Location, YamlDocument, read_file

BUS = "can0"  # of a simulated vehicle
MODES: Mapping[str, Sequence[str]] = {
    "ardusub": list(ardusub.Mode.__members__),
    "px4": list(px4.MainMode.__members__),
}
FLYABLE: Mapping[str, Sequence[str]] = {
    "ardusub": sorted(mode.name for mode in ardusub.FLYABLE),
    "px4": sorted(mode.name for mode in px4.FLYABLE),
}
_THRUSTER = re.compile(r"thruster ([0-9]+)", re.IGNORECASE)


def load_fitting(path: Path | str) -> tuple[Scenario, Profile]:
    """A scenario file and its vehicle, both checked, and that they go together.

    Raises:
        ConfigError: one of them has problems; it lists all of them.
    """
    document, path = read_file(path), Path(path)
    scenario = loaded(document, path)
    profile = _vehicle(scenario, document, path.parent)
    found = misfits(scenario, profile, entries_in(document))
    problems = [document.problem(location, value, wanted) for location, value, wanted in found]
    if problems:
        raise DocumentError(document.source, problems)
    return scenario, profile


def gateway_config(scenario: Scenario, path: Path, profile: Profile) -> Config:
    """The configuration that the gateway is played with, but for its bus and link.

    Args:
        scenario: whose settings are laid over.
        path: of its file.
        profile: of its vehicle.

    Raises:
        ConfigError: it has problems, or the scenario's own cannot be read.
    """
    own, source = scenario.gateway.config, f"{path}: the gateway's configuration"
    try:
        text, folder = config_text(scenario, path, profile)
        with TemporaryDirectory() as scratch:
            return write_config(scenario, text, Path(scratch), in_memory(), folder)[0]
    except (OSError, UnicodeDecodeError, TOMLDecodeError) as error:
        raise ConfigError(source, [Problem("gateway.config", own, f"cannot be read: {error}")]) from error
    except ConfigError as error:
        raise ConfigError(source, error.problems) from error


def check_recording(scenario: Scenario, path: Path, config: Config) -> None:
    """Whether the logs that a scenario names are there.

    Args:
        scenario: may have none.
        path: of its file.
        config: of its gateway.

    Raises:
        ConfigError: some are not, or are of no link.
    """
    logs = () if scenario.recording is None else scenario.recording.logs
    problems = [problem for log in logs for problem in _log_problems(log, path, config)]
    if problems:
        raise ConfigError(str(path), problems)


def misfits(
    scenario: Scenario, profile: Profile, entries: Sequence[Mapping[str, Any]] = ()
) -> Iterator[Contradiction]:
    """What a scenario speaks of and the vehicle does not have.

    Args:
        scenario: to look at.
        profile: of its vehicle.
        entries: its faults as the file has them; none: as many as the scenario has.
    """
    numbers = range(1, len(profile.thrusters) + 1)
    for place, fault in zip(places_of_faults(scenario, entries), scenario.faults, strict=True):
        if fault.subject.thruster is not None and fault.subject.thruster not in numbers:
            yield place, fault.subject.name, f"{profile.name} has thrusters 1 to {len(numbers)}"
        elif fault.subject.target is Target.BUS and scenario.recording is None and fault.subject.name != BUS:
            yield place, fault.subject.name, f"no bus of {profile.name}: want {BUS}"
    for location, subject in _subjects(scenario):
        number = _THRUSTER.match(subject)
        if number is not None and int(number[1]) not in numbers:
            yield location, subject, f"{profile.name} has thrusters 1 to {len(numbers)}"
    if scenario.recording is None:
        yield from _foreign_modes(scenario, profile)


def _vehicle(scenario: Scenario, document: YamlDocument, folder: Path) -> Profile:
    known = profile_names()
    if scenario.vehicle not in known and not is_file(folder / scenario.vehicle):
        nearest = get_close_matches(scenario.vehicle, known, n=1, cutoff=0.5)
        hint = f"did you mean {nearest[0]}?" if nearest else f"known: {', '.join(known)}"
        wanted = f"no such vehicle and no such file, {hint}"
        raise DocumentError(document.source, [document.problem(("vehicle",), scenario.vehicle, wanted)])
    return load_profile(scenario.vehicle, folder)


def _log_problems(log: str, path: Path, config: Config) -> Iterator[Problem]:
    try:
        located(log, config, path.parent)
    except OSError as error:
        yield Problem("recording.logs", log, f"cannot be read: {error.filename}: {error.strerror}")
    except ValueError as error:
        yield Problem("recording.logs", log, str(error))


def _subjects(scenario: Scenario) -> Iterator[tuple[Location, str]]:
    """Of all findings that are expected or forbidden."""
    for key in ("expect", "never"):
        for place, one in enumerate(getattr(scenario, key)):
            if one.finding is not None:
                yield (key, place, "finding", "subject"), one.finding.subject


def _foreign_modes(scenario: Scenario, profile: Profile) -> Iterator[Contradiction]:
    known = MODES[profile.autopilot]
    yield from _foreign(("mission", "mode"), scenario.mission.mode, FLYABLE[profile.autopilot], profile)
    for place, step in enumerate(scenario.mission.steps):
        yield from _foreign(("mission", "steps", place, "mode"), step.mode, known, profile)
    for place, one in enumerate(scenario.expect):
        for mode in _each(one.mode):
            yield from _foreign(("expect", place, "mode"), mode, known, profile)


def _foreign(location: Location, mode: str | None, known: Sequence[str], profile: Profile) -> Iterator[Contradiction]:
    if mode is not None and mode not in known:
        yield location, mode, f"no mode of {profile.autopilot} that it can be in here: want {', '.join(known)}"


def _each(mode: str | Iterable[str] | None) -> Iterable[str]:
    return () if mode is None else (mode,) if isinstance(mode, str) else mode
