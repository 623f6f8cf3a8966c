"""One target under atheris, which follows the coverage of our code: `python -m hil_tests.fuzz.guided NAME ARGS...`.

A process of its own for each, for libFuzzer ends it where it finds something. ARGS are libFuzzer's.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr
from io import StringIO

INSTRUMENTED = ["drivers", "gateway"]


def main(name: str, arguments: list[str]) -> None:
    """Fuzzes until libFuzzer ends the process.

    Raises:
        KeyError: no target has this name.
    """
    import atheris

    # it names every module
    with redirect_stderr(StringIO()), atheris.instrument_imports(include=INSTRUMENTED):
        from hil_tests.fuzz.catalogue import TARGETS
    target = TARGETS[name]
    target.check(b"")  # what it imports is no part of an input's time
    atheris.Setup([name, *arguments], _without_warnings(target.check))
    atheris.Fuzz()


def _without_warnings(check: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """A warning is a failure."""
    warnings.simplefilter("error")
    return check


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
