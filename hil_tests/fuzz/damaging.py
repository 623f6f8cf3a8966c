"""Fuzzing without looking at the code: damaged input by chance, the same in every run."""

from __future__ import annotations

import tracemalloc
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from random import Random

from hil_tests.fuzz.mutations import INPUT_MAX, random_damage
from hil_tests.fuzz.target import Target, require

DAMAGES_MAX = 6


@dataclass(frozen=True, slots=True)
class Failure:
    """An input that a target does not stand."""

    data: bytes
    error: Exception


def damaged_inputs(target: Target, seed: int = 0) -> Iterator[bytes]:
    """The valid inputs, then damaged ones without end."""
    seeds = [one[:INPUT_MAX] for one in target.seeds()]
    yield from seeds
    for number in count():
        chance = Random(f"{target.name} {seed} {number}")
        data = chance.choice(seeds)
        for _ in range(chance.randint(1, DAMAGES_MAX)):
            data = random_damage(chance, target.tokens, seeds).done_to(data)
        yield data


def first_failure(target: Target, inputs: Iterable[bytes]) -> Failure | None:
    """The first of the inputs that the target does not stand, or takes too much memory for; None: there is none."""
    # nothing comes first, untraced: what is imported, compiled or kept for good is no input's
    empty = _failure(target, b"")
    if empty is not None:
        return empty
    with _traced():
        return next((failure for data in inputs if (failure := _failure(target, data)) is not None), None)


def _failure(target: Target, data: bytes) -> Failure | None:
    try:
        checked(target, data)
    except Exception as error:  # whatever it is, it is what was looked for
        return Failure(data, error)
    return None


def checked(target: Target, data: bytes) -> None:
    """Runs a target on an input, with an eye on the memory where that is traced.

    Raises:
        AssertionError: it took more than it may.
        Warning: what nobody should have to read.
        Exception: what the target raises.
    """
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        target.check(data)
    taken = tracemalloc.get_traced_memory()[1] - before
    require(taken <= target.memory_max, f"{len(data)} bytes of input took {taken} bytes of memory")


@contextmanager
def _traced() -> Iterator[None]:
    """tracemalloc knows the memory of numpy's arrays, too."""
    begun = not tracemalloc.is_tracing()
    if begun:
        tracemalloc.start()
    try:
        yield
    finally:
        if begun:
            tracemalloc.stop()
