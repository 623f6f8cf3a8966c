"""Which modes of the autopilot are ours: what tells a pilot's override from what was asked for and comes late."""

from __future__ import annotations

from gateway.supervision.autopilots import Request

# one HEARTBEAT that was under way for long may still show the mode before
FOREIGN_HEARTBEATS = 2

_NONE: frozenset[int] = frozenset()


class Modes:
    """Modes as numbers in HEARTBEAT.custom_mode.

    Attributes:
        acted: something that was asked may stand, or still come about.
    """

    def __init__(self) -> None:
        self.acted = False
        self._ours = self._before = _NONE
        self._foreign = 0

    def heartbeat(self, mode: int) -> None:
        """Takes the mode of a HEARTBEAT: how often in a row it was not one of ours."""
        self._foreign = 0 if mode in self._ours else self._foreign + 1

    def announced(self, mode: int, standing: Request | None) -> None:
        """Something new will be asked: from now on, no override are the present mode, and what may come about late.

        Args:
            mode: the present one.
            standing: what was asked before and has come about; None: nothing has.
        """
        present = frozenset({mode})
        if standing is None:
            self._before = self._ours | self._before or present
        else:  # who has left our modes by now is seen at once
            self._before = (present & self._ours) | standing.after or self._ours or present
        self._ours, self._foreign = _NONE, 0

    def asked(self, request: Request) -> None:
        """A request goes out."""
        self._ours |= request.modes | request.after | request.as_good
        self.acted = True

    def came_about(self, request: Request | None, position_trusted: bool) -> None:
        """What is wanted stands; no other mode is ours or nobody's any more."""
        if request is not None:
            self._ours = request.good(position_trusted) | request.after
        self._before, self._foreign = _NONE, 0

    def overridden(self, mode: int, stands: bool) -> bool:
        """The mode is neither the one before nor one of ours; once it was ours, that has to last."""
        if stands:
            return self._foreign >= FOREIGN_HEARTBEATS and bool(self._ours)
        known = self._ours | self._before
        return bool(known) and mode not in known
