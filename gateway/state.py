"""What a run leaves to the next, on disk: whole or not at all, and read back without trusting it.

A line of JSON (format and SHA-256 of the rest), then a pickle of it. Reading admits the classes of this program,
plain containers, filterpy's filter, and numpy's arrays and generators, and nothing else that a pickle could call.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import pickle
from dataclasses import dataclass
from enum import EnumType
from pathlib import Path
from typing import Any

from gateway.channel import Learnt
from gateway.moment import Moment

FORMAT = "thruster-gateway state 4"
OUR_PACKAGES = frozenset({"detectors", "gateway"})
# values, and no drivers: those would open what they are for
OUR_VALUES = frozenset({"drivers.readings", "drivers.mavlink.messages", "drivers.mavlink.command_exchange"})
# a plain object of arrays, and the function by which it inverts them
KALMAN_FILTER = frozenset({("filterpy.kalman.kalman_filter", "KalmanFilter"), ("numpy.linalg", "inv")})
PLAIN = frozenset(
    {("collections", name) for name in ("Counter", "OrderedDict", "defaultdict", "deque")}
    | {("builtins", name) for name in ("set", "frozenset", "bytearray", "complex", "range", "slice")}
)
NUMPY = frozenset(
    {"ndarray", "dtype", "_reconstruct", "_frombuffer", "scalar", "PCG64", "SeedSequence", "Generator"}
    | {"__bit_generator_ctor", "__generator_ctor", "__pyx_unpickle_SeedSequence"}
)


class StateError(Exception):
    """A state file that cannot be used: damaged, or of another program or version."""


@dataclass(frozen=True, slots=True)
class State:
    """What a run leaves to the next.

    Attributes:
        saved: when.
        clock_s: the same by the clock of that run, which all its times are by.
        learnt: by subject: that which does not age.
        passing: what the supervisor knew then, of levels, acknowledgements and the like: that which does.
    """

    saved: Moment
    clock_s: float
    learnt: dict[str, Learnt]
    passing: object = None


def save(path: Path, state: State) -> None:
    """Writes the state in place of the old one; a crash leaves the old one.

    Raises:
        OSError: it cannot be written.
    """
    write(path, pack(state))


def pack(state: State) -> bytes:
    """The bytes of a state file."""
    payload = pickle.dumps(state)
    header = {"format": FORMAT, "sha256": hashlib.sha256(payload).hexdigest()}
    return json.dumps(header).encode() + b"\n" + payload


def write(path: Path, data: bytes) -> None:
    """Replaces a file by `data` in one step.

    Raises:
        OSError: it cannot be written.
    """
    temporary = path.with_name(path.name + ".new")
    with temporary.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)


def load(path: Path) -> State | None:
    """Reads a state file; None where there is none.

    Raises:
        StateError: it is not one of ours, or damaged.
        OSError: it cannot be read.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    return unpack(data)


def unpack(data: bytes) -> State:
    """Reads the bytes of a state file.

    Raises:
        StateError: see `load`.
    """
    header, _, payload = data.partition(b"\n")
    if _header(header) != {"format": FORMAT, "sha256": hashlib.sha256(payload).hexdigest()}:
        raise StateError("not a state file of this version, or damaged")
    try:
        state = _Unpickler(io.BytesIO(payload)).load()
    except Exception as error:  # whatever a pickle of another version stumbles over
        raise StateError(f"cannot be read: {error}") from error
    if not (isinstance(state, State) and _is_dated(state) and _are_learnt(state.learnt)):
        raise StateError("holds something else")
    return state


def _is_dated(state: State) -> bool:
    saved = state.saved
    return (
        isinstance(saved, Moment)
        and isinstance(saved.boot, str)
        and all(isinstance(time_s, float) for time_s in (saved.since_boot_s, saved.unix_s, state.clock_s))
    )


def _are_learnt(value: object) -> bool:
    return isinstance(value, dict) and all(
        isinstance(subject, str) and isinstance(one, Learnt) for subject, one in value.items()
    )


def _header(line: bytes) -> object:
    try:
        return json.loads(line)
    except ValueError:
        return None


def _member(kind: object, name: str) -> Any:
    """What `getattr` is in a pickle of some versions of Python 3.11: the way to a member of an enumeration."""
    if isinstance(kind, EnumType) and name in kind.__members__:
        return kind.__members__[name]
    raise StateError(f"{kind!r}.{name} does not belong in it")


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        package = module.partition(".")[0]
        if (package in OUR_PACKAGES or module in OUR_VALUES) and "." not in name:
            found = super().find_class(module, name)
            if isinstance(found, type) and found.__module__.startswith(f"{package}."):
                return found
        elif (module, name) in PLAIN | KALMAN_FILTER or (package == "numpy" and name in NUMPY):
            return super().find_class(module, name)
        elif (module, name) == ("builtins", "getattr"):
            return _member
        raise StateError(f"{module}.{name} does not belong in it")
