"""How a running gateway is, asked again and again over one connection."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from gateway.control.protocol import WATCH, Request
from gateway.control.tell import Conversation, GoneError, NoAnswerError
from gateway.telemetry import Telemetry


class Watching:
    """Asks the gateway whose control socket this is; where it was started again meanwhile, the new one.

    Args:
        path: of the control socket; a gateway need not run yet.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._conversation: Conversation | None = None

    def ask(self) -> Telemetry:
        """How it is now; waits for the answer, for 15 s at most.

        Raises:
            NoAnswerError: see there. The next time it is tried anew.
        """
        if self._conversation is not None:
            with suppress(GoneError):  # another one may run by now; or this one has not been asked for too long
                return self._asked(self._conversation)
        self._conversation = Conversation(self._path)
        return self._asked(self._conversation)

    def close(self) -> None:
        """Ends the connection; `ask` makes a new one."""
        conversation, self._conversation = self._conversation, None
        if conversation is not None:
            conversation.close()

    def _asked(self, conversation: Conversation) -> Telemetry:
        try:
            answer = conversation.ask(Request(WATCH))
        except NoAnswerError:
            self.close()
            raise
        if answer.telemetry is None:
            said = ", ".join(answer.lines) or "it does not say how it is"
            raise NoAnswerError(f"the gateway at {self._path} is another version: {said}")
        return answer.telemetry

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
