"""Where the vehicle is, in metres: one of the sources of positions is chosen, and kept for as long as it lives.

- **Sources.** Fixes of a positioning system (GPS_INPUT, then GPS_RAW_INT), the autopilot's local position, its global
  position: in this order, where the configuration leaves the choice open.
- **Alive** is a source whose position changes. A USBL that lost its vehicle says the same place with a good fix type
  for hours (so it does in 935 of 936 messages of a recorded dive), and an autopilot without any aiding stands still.
- **Choice.** The best one alive, `CHOICE_S` after the first one moved. It stays until it has not moved for
  `SILENT_S`, for two sources differ by their offsets: each switch is a jump of the track.
- **Frame.** The local position is taken as it is. The others become metres north and east of the first of them, or of
  the configured origin. `FAR_M` away from that a new origin is taken; a configured one is not given up, and the
  position is refused.
- **Depth** of a fix is the autopilot's, for that one has a pressure sensor; else the fix's own, else 0.
- **Refused** and counted in `drops`: repeated places, and times not after the one before. Nothing raises on data.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import hypot

from drivers.readings import GlobalPosition, LocalPosition, PositionFix
from gateway.local_frame import LocalFrame

PositionReading = LocalPosition | GlobalPosition | PositionFix

CHOICE_S = 3.0
SILENT_S = 10.0
FAR_M = 100_000.0  # at this distance the frame is 4 m short, and its north off by a degree and more

AUTO = "auto"
LOCAL, GLOBAL, FIX = "local", "global", "fix"
_RANKS = ("GPS_INPUT", "GPS_RAW_INT", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")


@dataclass(frozen=True, slots=True)
class Place:
    """A position in a frame that does not move: metres north, east and down."""

    time_s: float
    north_m: float
    east_m: float
    down_m: float


@dataclass(frozen=True, slots=True)
class _Heard:
    """The newest position of a source; `moved_s`: when it last differed from the one before, None: not yet."""

    time_s: float
    where: tuple[float, ...]
    moved_s: float | None = None


class PositionTrack:
    """Positions from all sources in, places of one source out. See the module's text for the rules.

    Args:
        wanted: "local", "global", "fix", or "auto".
        origin: of the frame for positions on the earth; None: the first of them. With an origin, local positions are
            not wanted, for nobody knows where their own origin is.

    Attributes:
        source: name of the chosen source, None before there is one.
        drops: refused positions by cause.
    """

    def __init__(self, wanted: str = AUTO, origin: LocalFrame | None = None) -> None:
        self._kinds = _kinds(wanted, origin is not None)
        self._waits = wanted == AUTO
        self._fixed_origin = origin is not None
        self.frame = origin
        self.source: str | None = None
        self.drops: Counter[str] = Counter()
        self._heard: dict[str, _Heard] = {}
        self._first_moved_s: float | None = None
        self._down_m: float | None = None

    @property
    def of_autopilot(self) -> bool:
        """True where positions are the autopilot's own estimate: under water that is made from its DVL."""
        return self.source in ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")

    def wants(self, reading: PositionReading) -> bool:
        """Whether this kind of position is one to choose from."""
        return isinstance(reading, self._kinds)

    def take(self, reading: PositionReading) -> Place | None:
        """The place where the chosen source sees the vehicle, None where this reading is no news of it."""
        if isinstance(reading, GlobalPosition):
            self._down_m = reading.depth_m
        source = _source(reading)
        if not self.wants(reading) or not self._moved(source, reading):
            return None
        self._choose(reading.time_s)
        return self._place(reading) if source == self.source else None

    def _moved(self, source: str, reading: PositionReading) -> bool:
        before, where = self._heard.get(source), _where(reading)
        if before is None:
            self._heard[source] = _Heard(reading.time_s, where)
            return False
        if reading.time_s <= before.time_s:
            self.drops["position time ran backwards"] += 1
            return False
        if where == before.where:
            self.drops["position repeated"] += 1
            return False
        self._heard[source] = _Heard(reading.time_s, where, moved_s=reading.time_s)
        if self._first_moved_s is None:
            self._first_moved_s = reading.time_s
        return True

    def _choose(self, time_s: float) -> None:
        alive = [name for name, heard in self._heard.items() if _alive(heard, time_s)]
        if self.source is not None and self.source not in alive:
            self.drops["position source silent"] += 1
            self.source = None
        settled = self._first_moved_s is not None and time_s - self._first_moved_s >= CHOICE_S
        if self.source is None and (settled or not self._waits):
            self.source = min(alive, key=_rank, default=None)

    def _place(self, reading: PositionReading) -> Place | None:
        if isinstance(reading, LocalPosition):
            return Place(reading.time_s, *reading.position_m)
        north_m, east_m = self._metres(reading)
        if not hypot(north_m, east_m) <= FAR_M:  # also for NaN
            self.drops["position far from the origin"] += 1
            return None
        return Place(reading.time_s, north_m, east_m, self._depth_m(reading))

    def _metres(self, reading: GlobalPosition | PositionFix) -> tuple[float, float]:
        place = reading.latitude_rad, reading.longitude_rad
        metres = self.frame.metres(*place) if self.frame is not None else None
        if metres is None or (not self._fixed_origin and not hypot(*metres) <= FAR_M):
            self.frame = LocalFrame(*place)
            return 0.0, 0.0
        return metres

    def _depth_m(self, reading: GlobalPosition | PositionFix) -> float:
        own_m = reading.depth_m
        return next(depth_m for depth_m in (self._down_m, own_m, 0.0) if depth_m is not None)


def _kinds(wanted: str, has_origin: bool) -> tuple[type, ...]:
    kinds: dict[str, tuple[type, ...]] = {
        LOCAL: (LocalPosition,),
        GLOBAL: (GlobalPosition,),
        FIX: (PositionFix,),
        AUTO: (PositionFix, GlobalPosition) if has_origin else (PositionFix, LocalPosition, GlobalPosition),
    }
    if wanted not in kinds or (has_origin and wanted == LOCAL):
        raise ValueError(f"wanted = {wanted!r}: want one of {', '.join(kinds)}, and not local with an origin")
    return kinds[wanted]


def _source(reading: PositionReading) -> str:
    match reading:
        case LocalPosition():
            return "LOCAL_POSITION_NED"
        case GlobalPosition():
            return "GLOBAL_POSITION_INT"
        case PositionFix():
            return reading.source


def _rank(source: str) -> tuple[int, str]:
    return next(rank for rank, start in enumerate(_RANKS) if source.startswith(start)), source


def _where(reading: PositionReading) -> tuple[float, ...]:
    if isinstance(reading, LocalPosition):
        return reading.position_m[:2]
    return reading.latitude_rad, reading.longitude_rad


def _alive(heard: _Heard, time_s: float) -> bool:
    return heard.moved_s is not None and time_s - heard.moved_s <= SILENT_S
