"""What a log has lost: counted by cause, with the places where to look."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field

PLACES_MAX = 5  # of each cause: enough to find it in an editor, few enough to read


class DamagedRecordError(Exception):
    """Within a reader: a line or an object is no record of its format. The text is the cause, as it is counted."""


@dataclass(slots=True)
class DamageReport:
    """What could not be read of one log.

    Attributes:
        records: frames, packets or messages that were read.
        lost: what was passed over, counted by cause.
        places: the first few of each cause, such as "line 12" or "offset 4711".
        bytes_read: how far the file is read by now.
    """

    records: int = 0
    lost: Counter[str] = field(default_factory=Counter)
    places: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    bytes_read: int = field(default=0, compare=False)

    def add(self, cause: str, place: str, count: int = 1) -> None:
        """Notes something that was passed over."""
        self.lost[cause] += count
        if len(self.places[cause]) < PLACES_MAX:
            self.places[cause].append(place)

    def lines(self) -> list[str]:
        """One for each cause, in words; none where nothing was lost."""
        return [
            f"{cause}: {count} ({', '.join(self.places[cause])}{', ...' if count > len(self.places[cause]) else ''})"
            for cause, count in self.lost.most_common()
        ]
