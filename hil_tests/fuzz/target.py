"""What is fuzzed: a parser, what it must hold to, and valid input to begin with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Check = Callable[[bytes], None]

MIB = 1 << 20


@dataclass(frozen=True, slots=True)
class Target:
    """A parser under test.

    Attributes:
        name: in small letters, as on the command line.
        about: what is read, and what must hold.
        check: reads the bytes; raises where the parser does, or where what it gives is not what it must be.
        seeds: makes valid input, small pieces of it; each call the same.
        tokens: bytes that mean something in the format, to be strewn in.
        memory_max: bytes that reading an input may take at most, over what is there before.

    Raises:
        ValueError: a name that is no word of small letters and underscores.
    """

    name: str
    about: str
    check: Check
    seeds: Callable[[], list[bytes]]
    tokens: tuple[bytes, ...] = ()
    memory_max: int = 32 * MIB

    def __post_init__(self) -> None:
        if not (self.name.isidentifier() and self.name.islower()):
            raise ValueError(f"name must be a word of small letters, got {self.name!r}")


def require(holds: bool, what: str) -> None:
    """Says that a parser does not do what it must.

    Raises:
        AssertionError: it does not hold. (`assert` would be silent under `python -O`.)
    """
    if not holds:
        raise AssertionError(what)
