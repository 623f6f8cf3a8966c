"""What this machine's operator says: readings as any others, in their turn, and answers in the same order."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence

from drivers.mavlink.messages import CommandAck, CommandResult
from drivers.readings import OperatorAct, OperatorRequest, Reading
from gateway.control.protocol import ACTS, Answer, Request
from gateway.control.subject_words import subjects_named
from gateway.findings import Finding
from gateway.operator import OWN_OPERATOR, code_of

# his readings come over no link
LINK = "operator"
# system and component that stand for him
HIMSELF = 0, 0
# judging is behind by seconds at most, or it is ended
ANSWER_S = 10.0
UNANSWERED = "no answer: the gateway is too busy, or stops"
# MAV_RESULT (None: no answer), and what was done, in words
_Done = tuple[int | None, str]


class LocalOperator:
    """Takes requests to the pipeline and its answers back.

    Args:
        watched: the subjects that there are.
        put: takes a link's reading for the pipeline; False where it takes none.
        now: the time.
    """

    def __init__(self, watched: Sequence[str], put: Callable[[str, Reading], bool], now: Callable[[], float]) -> None:
        self._watched, self._put, self._now = watched, put, now
        self._done = ""
        self._open: deque[asyncio.Future[_Done]] = deque()

    def say(self, act: OperatorAct, code: int, duration_s: float = 0.0) -> asyncio.Future[_Done] | None:
        """Says it; comes to what was done. None: the gateway takes nothing more in."""
        request = OperatorRequest(self._now(), act, code, duration_s, *HIMSELF)
        if not self._put(LINK, request):
            return None
        self._open.append(asyncio.get_running_loop().create_future())
        return self._open[-1]

    def note(self, finding: Finding) -> None:
        """What was done, in words; the answer comes after it."""
        if finding.detector == "operator" and finding.text.endswith(OWN_OPERATOR):
            self._done = finding.text.removesuffix(OWN_OPERATOR)

    def hear(self, ack: CommandAck) -> None:
        """An answer of the pipeline; one to somebody else is let pass."""
        if (ack.target_system, ack.target_component) == HIMSELF and self._open:
            waiting, done, self._done = self._open.popleft(), self._done, ""
            if not waiting.done():
                waiting.set_result((ack.result, done))

    async def do(self, request: Request) -> Answer:
        """Does one of the acts."""
        try:
            subjects = subjects_named(request.subjects, self._watched)
        except ValueError as error:
            return Answer(False, (str(error),))
        answers = [self.say(ACTS[request.ask], code_of(subject), request.duration_s) for subject in subjects]
        done = [await _result(answer) for answer in answers]
        return Answer(all(result == CommandResult.ACCEPTED for result, _ in done), tuple(said for _, said in done))


async def _result(answer: asyncio.Future[_Done] | None) -> _Done:
    if answer is None:
        return None, UNANSWERED
    try:
        async with asyncio.timeout(ANSWER_S):
            return await answer
    except TimeoutError:
        return None, UNANSWERED
