"""The numbers by which an operator names a subject, in param1 of MAV_CMD_USER_1 to 3.

| number | subject |
|---|---|
| 0 | all |
| 1 to 99 | thruster of that number |
| 101 | vehicle: its speed through the water |
| 102 to 105 | dvl, depth sensor, gyroscope, accelerometer |
| 106 | navigation: what no single sensor can be blamed for |
"""

from __future__ import annotations

from collections.abc import Mapping

ALL = "all"
THRUSTER = "thruster "
THRUSTER_MAX = 99

_NAMED: Mapping[int, str] = {
    0: ALL,
    101: "vehicle",
    102: "dvl",
    103: "depth sensor",
    104: "gyroscope",
    105: "accelerometer",
    106: "navigation",
}
CODES: Mapping[int, str] = _NAMED | {number: f"{THRUSTER}{number}" for number in range(1, THRUSTER_MAX + 1)}
_CODE_OF: Mapping[str, int] = {subject: code for code, subject in CODES.items()}


def subject_of(code: int) -> str | None:
    """The subject of a number, None where no subject has it."""
    return CODES.get(code)


def code_of(subject: str) -> int:
    """The number of a subject as the findings call it, or of "all".

    Raises:
        ValueError: it has none.
    """
    try:
        return _CODE_OF[subject]
    except KeyError:
        raise ValueError(
            f"subject = {subject!r}: want one of {', '.join(_NAMED.values())} or thruster 1..99"
        ) from None
