"""CAN formats: bytes to readings by our drivers, and bytes to values by the packages that are commonly used for it.

Both sides start from identifier and data of each frame; the peers stop at their own message objects, ours go on to
readings. Every call decodes a whole stream, with decoders of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files
from typing import Any

import can
import cantools

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.frame import CanFrame
from drivers.command import CommandScale
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from hil_tests.bench.timing import Comparison

Bits = tuple[int, bytes]  # identifier and data of a frame
MESSAGES = 1500
PERIOD_S = 0.02


def numbers(readings: Sequence[Reading], command_full: float) -> list[int]:
    """Speeds, and commands as counts, in order."""
    numbers = []
    for reading in readings:
        if isinstance(reading, ThrusterCommand):
            numbers.append(round(reading.fraction * command_full))
        elif isinstance(reading, ThrusterReport) and reading.speed_rpm is not None:
            numbers.append(round(reading.speed_rpm))
    return numbers


def dbc_status() -> Comparison:
    """A vendor's commands and status by the example's DBC file: speed, voltage and current."""
    with as_file(files("gateway") / "examples" / "vendor_thruster.dbc") as path:
        database: Any = cantools.database.load_file(path)
        decoder = DbcDecoder(
            path,
            [
                DbcThruster(
                    thruster=1,
                    command="StarboardCommand.Percent",
                    command_scale=CommandScale(-100.0, 0.0, 100.0),
                    speed="StarboardStatus.Speed",
                    voltage="StarboardStatus.Voltage",
                    current="StarboardStatus.Current",
                )
            ],
        )
    frames = _vendor_frames(database)

    def ours() -> list[Reading]:
        readings: list[Reading] = []
        for number, (identifier, data) in enumerate(frames):
            readings += decoder.decode(CanFrame(PERIOD_S * number, identifier, data, extended=False))
        return readings

    def theirs() -> list[Any]:
        values = []
        for number, (identifier, data) in enumerate(frames):
            message = can.Message(PERIOD_S * number, identifier, is_extended_id=False, data=data)
            values.append(database.decode_message(message.arbitration_id, message.data))
        return values

    def agree(readings: Sequence[Reading], values: Sequence[dict[str, float]]) -> bool:
        wanted = [round(value.get("Speed", 10.0 * value.get("Percent", 0.0))) for value in values]
        return numbers(readings, 1000.0) == wanted

    work, peer = "DBC command and status", "cantools, python-can Message"
    return Comparison(work, peer, "message", len(frames), ours, theirs, agree)


def _vendor_frames(database: Any) -> list[Bits]:
    command, status = (database.get_message_by_name(name) for name in ("StarboardCommand", "StarboardStatus"))
    frames = []
    for number in range(MESSAGES // 2):
        values = {"Speed": (37 * number) % 6000 - 3000, "Voltage": 15.5, "Current": 0.25 * (number % 64)}
        frames.append((command.frame_id, command.encode({"Percent": number % 201 - 100})))
        frames.append((status.frame_id, status.encode(values)))
    return frames
