"""How a simulated autopilot deals with commands where it is not to do what it should."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from hil_tests.rig.commands import Result


@dataclass(frozen=True, slots=True)
class Reply:
    """One way to deal with a command.

    Attributes:
        result: what is said; None: nothing is.
        obeyed: whether it is done. "ACCEPTED, but not obeyed" is a mode that never shows in HEARTBEAT; "not
            answered, but obeyed" is an answer that was lost.
        after_s: IN_PROGRESS is said at once, and the result, if there is one, so much later; 0: at once.

    Raises:
        ValueError: a time that is negative.
    """

    result: Result | None
    obeyed: bool = False
    after_s: float = 0.0

    def __post_init__(self) -> None:
        if not self.after_s >= 0.0:
            raise ValueError(f"after_s = {self.after_s!r}: want 0 or more seconds")


SILENCE = Reply(None)
NOT_SHOWN = Reply(Result.ACCEPTED)


@dataclass(slots=True)
class Conduct:
    """What is made of which command; without a word here, the autopilot does what it should.

    Attributes:
        ground_station_only: commands from other systems than 255 are not even answered, as with ArduPilot's
            MAV_OPTIONS bit 0 or its SYSID_ENFORCE.
    """

    ground_station_only: bool = False
    _next: dict[tuple[int, float | None], deque[Reply]] = field(default_factory=dict)
    _always: dict[tuple[int, float | None], Reply] = field(default_factory=dict)

    def then(self, command: int, *replies: Reply, second: float | None = None) -> None:
        """The next of these commands are dealt with like this, one after the other.

        Args:
            command: MAV_CMD.
            replies: in their order.
            second: only with this param2, which is the mode in DO_SET_MODE; None: with any.
        """
        self._next.setdefault((command, second), deque()).extend(replies)

    def always(self, command: int, reply: Reply, second: float | None = None) -> None:
        """All of these commands are dealt with like this from now on; arguments as in `then`."""
        self._always[command, second] = reply

    def reply(self, command: int, parameters: tuple[float, ...]) -> Reply | None:
        """How to deal with this one; None: as it should be."""
        for key in ((command, parameters[1]), (command, None)):
            if self._next.get(key):
                return self._next[key].popleft()
            if key in self._always:
                return self._always[key]
        return None
