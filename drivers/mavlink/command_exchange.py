"""One command and its answers, as the MAVLink command protocol has it. Pure: time is passed in.

A command that is not answered within a second is sent again with its confirmation count raised, three times in all.
IN_PROGRESS extends the wait, TEMPORARILY_REJECTED is tried again when it is due; every other result is final. Answers
are told apart by command and sender only (the protocol has no number for a request), so there must never be two of
the same command under way to one autopilot, and answers to the tries of the one before are let pass for a while.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum, auto

from drivers.mavlink.messages import CommandLong, CommandResult
from drivers.readings import CommandAcknowledgement

ANSWER_S = 1.0
TRIES = 3
# an answer may be under way for so long
OWED_S = 1.0
# "in progress" for longer than this is no answer
PROGRESS_MAX_S = 30.0

RESULT_WORDS: Mapping[int, str] = {
    CommandResult.ACCEPTED: "accepted",
    CommandResult.TEMPORARILY_REJECTED: "rejected for now",
    CommandResult.DENIED: "denied",
    CommandResult.UNSUPPORTED: "unsupported",
    CommandResult.FAILED: "failed",
    CommandResult.CANCELLED: "cancelled",
}
NO_ANSWER = "not answered"


class Ended(Enum):
    """How an exchange ended."""

    ACCEPTED = auto()
    REFUSED = auto()
    UNANSWERED = auto()


class CommandExchange:
    """A command that was sent at `time_s`, and waits for its answer.

    Args:
        command: as it was sent, confirmation 0.
        time_s: when.
        before: the exchange before it with this autopilot, whose answers may still come.

    Attributes:
        ended: None while it is under way.
        word: the newest answer in words, "not answered" before any.
    """

    def __init__(self, command: CommandLong, time_s: float, before: CommandExchange | None = None) -> None:
        self._command = command
        self._answered = 0
        self._owed = 0 if before is None or before.command != command.command else before.owed
        self._began_s = time_s
        self._due_s = time_s + ANSWER_S
        self.ended: Ended | None = None
        self.word = NO_ANSWER

    @property
    def command(self) -> int:
        """MAV_CMD."""
        return self._command.command

    @property
    def owed(self) -> int:
        """Tries that have not been answered."""
        return self._command.confirmation + 1 - self._answered

    def answers(self, reading: CommandAcknowledgement) -> bool:
        """Whether a COMMAND_ACK is an answer to this command."""
        ours = (self._command.command, self._command.target_system, self._command.target_component)
        return (reading.command, reading.system_id, reading.component_id) == ours

    def acknowledge(self, reading: CommandAcknowledgement) -> None:
        """Takes a COMMAND_ACK; one that answers something else, or comes too late, means nothing."""
        if not self.answers(reading):
            return
        if self._owed > 0 and reading.time_s - self._began_s < OWED_S:
            self._owed -= 1  # if it was ours after all: the next try is answered, too
            return
        if reading.result != CommandResult.IN_PROGRESS:
            self._answered += 1
        if self.ended is not None:
            return
        if reading.result == CommandResult.IN_PROGRESS:
            self._due_s = min(reading.time_s + ANSWER_S, self._began_s + PROGRESS_MAX_S)
            return
        self.word = RESULT_WORDS.get(reading.result, f"result {reading.result}")
        if reading.result == CommandResult.ACCEPTED:
            self.ended = Ended.ACCEPTED
        elif reading.result != CommandResult.TEMPORARILY_REJECTED:
            self.ended = Ended.REFUSED

    def advance(self, time_s: float) -> CommandLong | None:
        """The command once more where its answer is overdue; after the last try the exchange has ended."""
        if self.ended is not None or time_s < self._due_s:
            return None
        if self._command.confirmation + 1 >= TRIES or time_s - self._began_s >= PROGRESS_MAX_S:
            self.ended = Ended.UNANSWERED if self.word == NO_ANSWER else Ended.REFUSED
            return None
        self._command = replace(self._command, confirmation=self._command.confirmation + 1)
        self._due_s = time_s + ANSWER_S
        return self._command
