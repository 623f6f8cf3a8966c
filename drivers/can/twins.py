"""Thrusters on one bus that cannot be told apart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence


def twins(name: str, numbers: Sequence[int]) -> list[str]:
    """What is wrong where each thruster must have a number of its own: one text for each that several have.

    Args:
        name: of the setting whose numbers they are.
        numbers: of all thrusters.
    """
    several = sorted(number for number, count in Counter(numbers).items() if count > 1)
    return [f"{name} must differ from thruster to thruster, got {number} more than once" for number in several]


def refuse_twins(**numbers: Sequence[int]) -> None:
    """Each setting's numbers must differ.

    Raises:
        ValueError: several thrusters have one; all problems in one go.
    """
    if problems := [problem for name, those in numbers.items() for problem in twins(name, those)]:
        raise ValueError("; ".join(problems))
