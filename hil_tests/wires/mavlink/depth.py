"""Depth in metres: as pressure of the water, or as the autopilot's altitude where it tells no pressure.

That is what the gateway takes for its depth sensor (`gateway.motion`). An altitude beside a pressure is made of it by
the autopilot's filter, which a wire does not reach: it stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivers.mavlink.formats import GLOBAL_POSITION_INT, SCALED_PRESSURES, MessageFormat
from gateway.config_sections import Navigation
from gateway.motion import STANDARD_GRAVITY_MPS2
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.signal import Linear, Signal

PASCALS_PER_HECTOPASCAL = 100.0
PRESSURE_PLACE, ALTITUDE_PLACES = 1, (3, 4)  # altitude above the sea, and above home
MM_UPWARDS = -1e-3  # in metres of depth


class WaterPressure(Linear):
    """SCALED_PRESSURE*.press_abs: hectopascals.

    Args:
        message: one of the three.
        water: with its density, and the pressure at its surface.

    Attributes:
        heard: whether it has come at all.
    """

    def __init__(self, message: MessageFormat, water: Navigation) -> None:
        metres = PASCALS_PER_HECTOPASCAL / (water.water_density_kgm3 * STANDARD_GRAVITY_MPS2)
        super().__init__(
            message, PRESSURE_PLACE, unit=metres, zero=water.surface_pressure_pa / PASCALS_PER_HECTOPASCAL
        )
        self.heard = False

    def read(self, payload: bytes) -> Vector | None:
        """See `Signal`."""
        self.heard = True
        return super().read(payload)


class Altitude(Linear):
    """One of the two altitudes of GLOBAL_POSITION_INT, while no pressure has been heard.

    Args:
        place: of it, see `Fields.of`.
        pressures: that would be the depth instead.
    """

    def __init__(self, place: int, pressures: Sequence[WaterPressure]) -> None:
        super().__init__(GLOBAL_POSITION_INT, place, unit=MM_UPWARDS)
        self._pressures = pressures

    def read(self, payload: bytes) -> Vector | None:
        """See `Signal`."""
        return None if any(pressure.heard for pressure in self._pressures) else super().read(payload)


def depths(water: Navigation) -> list[Signal]:
    """Wherever the depth is told that a gateway of this configuration reads."""
    in_hull, *in_water = SCALED_PRESSURES  # ArduSub's first barometer is in the dry hull
    messages = {"global_position": (), "scaled_pressure": (in_hull,)}.get(water.depth, in_water)
    pressures = [WaterPressure(message, water) for message in messages]
    return [*pressures, *(Altitude(place, pressures) for place in ALTITUDE_PLACES)]
