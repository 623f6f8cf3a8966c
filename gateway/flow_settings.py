"""What the configuration knows of the current, as a model of the flow: `[speed.flow]`."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians

from detectors.speed.flow import FlowModel
from detectors.speed.flow_models import ConstantFlow, TidalConstituent, TidalFlow
from gateway.config_sections import Constituent, Flow
from gateway.current_forecast import ForecastError, load_forecast
from gateway.problems import Problem, is_file

PATH = "speed.flow"
CONSTANT = ("speed_mps", "direction_deg")
SITE = ("latitude_deg", "longitude_deg")
NAMES = ("eastward", "northward")
AMPLITUDES = ("north_mps", "north_lag_deg", "east_mps", "east_lag_deg")
ELLIPSE = ("semi_major_mps", "semi_minor_mps", "inclination_deg", "lag_deg")


def flow_model(flow: Flow) -> tuple[FlowModel | None, list[Problem]]:
    """The model that a table describes, or everything that is wrong with it. A forecast is read from its file."""
    problems = [*_contradictions(flow), *_incomplete(flow), *_absent_file(flow)]
    if problems:
        return None, problems
    try:
        return _model(flow), []
    except ForecastError as error:
        return None, [Problem(f"{PATH}.file", flow.file, str(error).removeprefix(f"{flow.file}: "))]
    except ValueError as error:
        return None, [Problem(f"{PATH}.constituents", None, str(error))]


def _contradictions(flow: Flow) -> Iterator[Problem]:
    given = [key for key in (*CONSTANT, "constituents") if key in flow.model_fields_set]
    if flow.file is not None:
        for key in given:
            yield Problem(
                f"{PATH}.{key}", getattr(flow, key), "the file says what the current is: remove one of them"
            )
    elif not given:
        yield Problem(PATH, None, f"empty: want {' and '.join(CONSTANT)}, constituents, or a file")
    else:
        for key in (*SITE, *NAMES):
            if key in flow.model_fields_set:
                yield Problem(f"{PATH}.{key}", getattr(flow, key), "means nothing without a file")


def _incomplete(flow: Flow) -> Iterator[Problem]:
    """Keys that need each other."""
    groups: list[tuple[str, ...]] = [CONSTANT, NAMES]
    if flow.file is not None:
        groups.append(("file", *SITE))
    for keys in groups:
        missing = [key for key in keys if getattr(flow, key) is None]
        if 0 < len(missing) < len(keys):
            for key in missing:
                others = ", ".join(other for other in keys if other != key)
                yield Problem(f"{PATH}.{key}", None, f"missing: it belongs to {others}")
    for constituent in flow.constituents:
        given = constituent.model_fields_set - {"name"}
        if given not in (set(AMPLITUDES), set(ELLIPSE)):
            wanted = f"want its amplitudes ({', '.join(AMPLITUDES)}) or its ellipse ({', '.join(ELLIPSE)})"
            yield Problem(f"{PATH}.constituents[name={constituent.name}]", None, wanted)


def _absent_file(flow: Flow) -> Iterator[Problem]:
    if flow.file is not None and not is_file(flow.file):
        yield Problem(
            f"{PATH}.file", flow.file, "no such file (a relative path starts at the configuration's folder)"
        )


def _model(flow: Flow) -> FlowModel:
    site = flow.site()
    if flow.file is not None and site is not None:
        names = None if flow.eastward is None or flow.northward is None else (flow.eastward, flow.northward)
        return load_forecast(flow.file, site, variables=names)
    mean = ConstantFlow.towards(flow.speed_mps or 0.0, radians(flow.direction_deg or 0.0))
    if not flow.constituents:
        return mean
    return TidalFlow((mean.north_mps, mean.east_mps), tuple(map(_constituent, flow.constituents)))


def _constituent(one: Constituent) -> TidalConstituent:
    if one.north_mps is not None:
        lags = radians(one.north_lag_deg or 0.0), radians(one.east_lag_deg or 0.0)
        return TidalConstituent(one.name, one.north_mps, lags[0], one.east_mps or 0.0, lags[1])
    major_mps, minor_mps = one.semi_major_mps or 0.0, one.semi_minor_mps or 0.0
    angles = radians(one.inclination_deg or 0.0), radians(one.lag_deg or 0.0)
    return TidalConstituent.from_ellipse(one.name, major_mps, minor_mps, *angles)
