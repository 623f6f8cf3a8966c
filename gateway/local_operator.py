"""What this machine's operator says: readings as any others, in their turn, and answers in the same order."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from math import ceil

from drivers.mavlink.messages import CommandAck
from drivers.readings import OperatorAct, OperatorRequest
from gateway.control_protocol import ACTS, Answer, Request
from gateway.judging import Work
from gateway.operator import MUTE_S, RESULT_ACCEPTED, code_of
from gateway.pipeline import Arrival
from gateway.subject_words import subjects_named

# his readings come over no link
LINK = "operator"
# system and component that stand for him
HIMSELF = 0, 0
# judging is behind by seconds at most, or it is ended
ANSWER_S = 10.0


class LocalOperator:
    """Takes requests to the pipeline and its answers back.

    Args:
        watched: the subjects that there are.
        put: takes work for the pipeline; False where it takes none.
        now: the time.
    """

    def __init__(self, watched: Sequence[str], put: Callable[[Work], bool], now: Callable[[], float]) -> None:
        self._watched, self._put, self._now = watched, put, now
        self._open: deque[asyncio.Future[int]] = deque()

    def say(self, act: OperatorAct, code: int, duration_s: float = 0.0) -> asyncio.Future[int] | None:
        """Says it; comes to a MAV_RESULT. None: the gateway takes nothing more in."""
        request = OperatorRequest(self._now(), act, code, duration_s, *HIMSELF)
        if not self._put(Arrival(LINK, [request])):
            return None
        self._open.append(asyncio.get_running_loop().create_future())
        return self._open[-1]

    def hear(self, ack: CommandAck) -> None:
        """An answer of the pipeline; one to somebody else is let pass."""
        if (ack.target_system, ack.target_component) == HIMSELF and self._open:
            waiting = self._open.popleft()
            if not waiting.done():
                waiting.set_result(ack.result)

    async def do(self, request: Request) -> Answer:
        """Does one of the acts."""
        try:
            subjects = subjects_named(request.subjects, self._watched)
        except ValueError as error:
            return Answer(False, (str(error),))
        answers = [
            (subject, self.say(ACTS[request.ask], code_of(subject), request.duration_s)) for subject in subjects
        ]
        results = [(subject, await _result(answer)) for subject, answer in answers]
        return Answer(
            all(result == RESULT_ACCEPTED for _, result in results),
            tuple(f"{subject}: {_words(request, result)}" for subject, result in results),
        )


async def _result(answer: asyncio.Future[int] | None) -> int | None:
    if answer is None:
        return None
    try:
        async with asyncio.timeout(ANSWER_S):
            return await answer
    except TimeoutError:
        return None


def _words(request: Request, result: int | None) -> str:
    if result is None:
        return "no answer, the gateway is too busy or stops"
    if result != RESULT_ACCEPTED:
        return f"refused (MAV_RESULT {result})"
    match ACTS[request.ask]:
        case OperatorAct.ACCEPT:
            return "accepted as it is"
        case OperatorAct.ACKNOWLEDGE:
            return "acknowledged"
        case OperatorAct.MUTE:
            return f"muted for {ceil((request.duration_s or MUTE_S) / 60.0)} min"
