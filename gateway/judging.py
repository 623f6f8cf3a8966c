"""The pipeline at work in a thread of its own: batch after batch, in the order of arrival, and nothing lost unseen.

What arrives while a batch is judged is the next batch: the slower the machine, the larger the batches, and the less a
sample costs (of 8 thrusters at 50 Hz: a third in batches of 0.1 s, a quarter in batches of 0.5 s). A detector that
learns its model anew (tens of milliseconds) delays neither a link nor a heartbeat.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from drivers.clock import Clock
from gateway.pipeline import Arrival, Event, Now, Outcome, Pipeline

log = logging.getLogger("gateway")

# What arrives within this time is judged together, at a third of the cost; nobody sees a tenth of a second
COLLECT_S = 0.1
# A reading is stamped when the kernel has it, and judged a little later: silence is judged after that delay
LATENESS_S = 0.1
# Some ten seconds of a full bus; what does not fit is lost
WAITING_MAX = 10_000
# The pilot is to hear of a fault within a second: this far behind is worth a line in the log ...
BEHIND_S = 0.5
# ... and this close to the present it has caught up
CAUGHT_UP_S = 0.3

# An event for the pipeline, or something else that is to happen to it in its turn
Work = Event | Callable[[], Sequence[Outcome]]


class Judging:
    """Work for the pipeline in, outcomes out.

    Args:
        pipeline: nobody else may touch it from now on, other than as work or after the end.
        clock: to see how far behind judging is.
        record: gets each batch's outcomes in the worker thread, for what takes time.
        tell: gets them in the event loop.

    Attributes:
        lost: readings that were not judged, by cause.
        behind_max_s: the longest that an event has waited for its outcomes, in seconds.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        clock: Clock,
        record: Callable[[Sequence[Outcome]], None],
        tell: Callable[[Sequence[Outcome]], None],
    ) -> None:
        self._pipeline, self._clock, self._record, self._tell = pipeline, clock, record, tell
        self._waiting: asyncio.Queue[Work] = asyncio.Queue(WAITING_MAX)
        self._closed = False
        self._told_s = 0.0  # how far behind it was when that was last said, 0 = it has caught up
        self.lost: Counter[str] = Counter()
        self.behind_max_s = 0.0

    def put(self, work: Work) -> None:
        """Takes work, for as long as there is room. After `close` it takes none."""
        if self._closed:
            return
        try:
            self._waiting.put_nowait(work)
        except asyncio.QueueFull:
            self._lose(len(work.readings) if isinstance(work, Arrival) else 1)

    def advance(self, now_s: float) -> None:
        """The time, told now and then."""
        self.put(Now(now_s - LATENESS_S))

    async def close(self) -> None:
        """Takes no more, and comes back when all that came before is judged and told."""
        self._closed = True
        await self._waiting.join()

    async def run(self) -> None:
        """Judges until it is cancelled."""
        while True:
            await asyncio.sleep(COLLECT_S)
            batch = [await self._waiting.get(), *self._rest()]
            await self._judge(batch)
            self._look_at_pace(batch)
            for _ in batch:
                self._waiting.task_done()

    def finish(self) -> None:
        """Judges here and now what still waits, after `run` was cancelled."""
        self._tell(self._process(self._rest()))

    def _rest(self) -> list[Work]:
        return [self._waiting.get_nowait() for _ in range(self._waiting.qsize())]

    async def _judge(self, batch: Sequence[Work]) -> None:
        """A thread cannot be cancelled: whoever cancels us gets his way when the batch is judged and told."""
        judging = asyncio.create_task(asyncio.to_thread(self._process, batch), name="judging")
        cancelled = False
        while not judging.done():
            try:
                await asyncio.wait([judging])
            except asyncio.CancelledError:
                cancelled = True
        self._tell(judging.result())
        if cancelled:
            raise asyncio.CancelledError

    def _process(self, batch: Iterable[Work]) -> list[Outcome]:
        outcomes: list[Outcome] = []
        events: list[Event] = []
        for work in batch:
            if isinstance(work, Arrival | Now):
                events.append(work)
            else:  # in its turn: after the events before it
                outcomes += self._pipeline.take(events)
                outcomes += work()
                events = []
        outcomes += self._pipeline.take(events)
        self._record(outcomes)
        return outcomes

    def _lose(self, readings: int) -> None:
        if not self.lost:
            log.error("judging is so far behind that readings are lost: this machine is too slow or too busy")
        self.lost["machine too slow"] += readings

    def _look_at_pace(self, judged: Iterable[Work]) -> None:
        """Says when judging falls behind and when it has caught up, by the time that its oldest tick has waited."""
        tick = next((work for work in judged if isinstance(work, Now)), None)
        if tick is None:
            return
        behind_s = self._clock.now() - tick.time_s - LATENESS_S
        self.behind_max_s = max(self.behind_max_s, behind_s)
        if behind_s > max(BEHIND_S, 2.0 * self._told_s):
            log.warning("judging is %.1f s behind: this machine is too slow or too busy", behind_s)
            self._told_s = behind_s
        elif self._told_s and behind_s < CAUGHT_UP_S:
            log.info("judging has caught up")
            self._told_s = 0.0
