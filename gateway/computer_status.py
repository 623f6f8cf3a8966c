"""How the machine is that we run on, for ground stations: load, temperatures, memory, and room for the findings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil

from drivers.mavlink.messages import ComputerStatus

MIB = 2**20
# What kernels call sensors in a processor, beside all that have "cpu" in their names (of a Raspberry Pi, a Jetson)
PROCESSOR_SENSORS = frozenset({"coretemp", "k10temp", "zenpower", "soc_thermal"})
# Of those, what is no temperature of a core: the package's, or a fan controller's idea of it
NOT_A_CORE = ("package", "tctl")


class ComputerWatch:
    """Looks at the machine when it is asked.

    Args:
        place: a directory on the storage whose room matters: where the findings go.
    """

    def __init__(self, place: Path) -> None:
        self._place = place
        psutil.cpu_percent(percpu=True)  # load is measured from one call to the next

    def status(self, unix_s: float) -> ComputerStatus:
        """The machine now; what it does not tell is left out.

        Args:
            unix_s: now.
        """
        return ComputerStatus(
            unix_s=unix_s,
            uptime_s=max(0.0, unix_s - psutil.boot_time()),
            cpu_percent=tuple(psutil.cpu_percent(percpu=True)),
            core_celsius=tuple(_core_celsius()),
            memory_mib=_told(_memory_mib),
            storage_mib=_told(self._storage_mib),
        )

    def _storage_mib(self) -> tuple[int, int]:
        usage = psutil.disk_usage(str(self._place))
        return usage.used // MIB, usage.total // MIB


def _told(measure: Callable[[], tuple[int, int]]) -> tuple[int, int] | None:
    try:
        return measure()
    except OSError:
        return None


def _memory_mib() -> tuple[int, int]:
    memory = psutil.virtual_memory()
    return (memory.total - memory.available) // MIB, memory.total // MIB


def _core_celsius() -> Iterator[float]:
    try:
        sensors: dict[str, list[Any]] = psutil.sensors_temperatures()
    except (AttributeError, OSError):  # not on this system; gone while it was read
        return
    for name, readings in sensors.items():
        if name in PROCESSOR_SENSORS or "cpu" in name.lower():
            yield from (one.current for one in readings if not one.label.lower().startswith(NOT_A_CORE))
