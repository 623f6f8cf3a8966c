"""What all parts of a scenario file have in common: their keys are checked, and their numbers are numbers."""

from __future__ import annotations

import re
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict

ItemT = TypeVar("ItemT")

Seconds = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
SecondsAbove0 = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Stick = Annotated[float, Field(ge=-1.0, le=1.0)]
Bearing = Annotated[float, Field(ge=-360.0, le=360.0)]
Several = Annotated[tuple[ItemT, ...], Strict(False)]  # a list of the file


class Section(BaseModel):
    """A part of a scenario: no keys but its own, no text for a number, no changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def _compiled(text: str) -> str:
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        raise ValueError(f"no regular expression: {error}") from error
    return text


Pattern = Annotated[str, Field(min_length=1), AfterValidator(_compiled)]
