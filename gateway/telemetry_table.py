"""A telemetry as a table of plain values, for JSON, and back."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from gateway.telemetry import Telemetry


def table_of(telemetry: Telemetry) -> dict[str, Any]:
    """Names, numbers, lists and tables; levels are numbers, what is not known is NaN or None."""
    table: dict[str, Any] = _adapter().dump_python(telemetry, mode="json")
    return table


def telemetry_of(table: object) -> Telemetry:
    """Reads such a table. What a newer version tells beside is left out.

    Raises:
        ValueError: it is none.
    """
    try:
        return _adapter().validate_python(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"])) or "telemetry"
        raise ValueError(f"no telemetry: {place} = {first['input']!r:.60}: {first['msg']}") from error


@cache
def _adapter() -> TypeAdapter[Telemetry]:
    """Made when it is first needed: it takes milliseconds."""
    return TypeAdapter(Telemetry)
