"""The pipeline at work in a thread of its own: batch after batch, in the order of arrival, and nothing lost unseen.

What arrives while a batch is judged is the next batch: the slower the machine, the larger the batches, and the less a
sample costs (of 8 thrusters at 50 Hz: a third in batches of 0.1 s, a quarter in batches of 0.5 s). A detector that
learns its model anew (tens of milliseconds) delays neither a link nor a heartbeat.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from math import inf

from drivers.clock import Clock
from drivers.readings import Lateness
from gateway.pipeline import Arrival, Event, Now, Outcome, Pipeline
from gateway.recording.journal import Journal, NoJournal

# What arrives within this time is judged together, at a third of the cost; nobody sees a tenth of a second
COLLECT_S = 0.1
# A reading is stamped when the kernel has it, and judged a little later: silence is judged after that delay
LATENESS_S = 0.1
# Some ten seconds of a full bus; what does not fit is lost
WAITING_MAX = 10_000
# Some seconds of full buses: more at once is hardly cheaper, and a stop would have to wait for it
BATCH_MAX = 200
# at the end, when every one may be the last for which there is time
LAST_BATCH_MAX = 20
# How late it is, is said this often
PACE_PERIOD_S = 1.0
# the readings that are about the gateway itself come over no link
GATEWAY = "gateway"

# An event for the pipeline, or something else that is to happen to it in its turn
Work = Event | Callable[[], Sequence[Outcome]]


class Judging:
    """Work for the pipeline in, outcomes out.

    Args:
        pipeline: nobody else may touch it from now on, other than as work or after the end.
        clock: to see how far behind judging is.
        record: gets each batch's outcomes in the worker thread, for what takes time.
        tell: gets them in the event loop.
        collect_s: what arrives within this time is judged together.
        journal: where the times that the pipeline is told are written down, and how late it is.

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
        collect_s: float = COLLECT_S,
        journal: Journal | None = None,
    ) -> None:
        self._pipeline, self._clock, self._record, self._tell = pipeline, clock, record, tell
        self._collect_s, self._journal = collect_s, journal or NoJournal()
        self._waiting: asyncio.Queue[tuple[Work, int]] = asyncio.Queue(WAITING_MAX)
        self._closed = False
        self._pace = _Pace()
        self.lost: Counter[str] = Counter()
        self.behind_max_s = 0.0
        self._behind_s, self._oldest_s = 0.0, inf

    @property
    def behind_s(self) -> float:
        """How long the last events have waited for their outcomes; those that are being judged, until now."""
        return max(self._behind_s, self._clock.now() - self._oldest_s - LATENESS_S)

    def put(self, work: Work, place: int | None = None) -> bool:
        """Takes work, for as long as there is room; False where it is not taken. After `close` none is.

        `place`: in the journal, of the first that it is made of; None: nothing of it is written down.
        """
        if self._closed:
            return False
        try:
            self._waiting.put_nowait((work, self._journal.place + 1 if place is None else place))
        except asyncio.QueueFull:
            self._lose("machine too slow", work)
            return False
        return True

    def advance(self, now_s: float) -> None:
        """The time, told now and then."""
        if not self._closed:
            self._journal.now(now_s - LATENESS_S)
            self.put(Now(now_s - LATENESS_S), self._journal.place)

    async def close(self, within_s: float) -> None:
        """Takes no more, and comes back when all that came before is judged and told, or the time is over."""
        self._closed = True
        with suppress(TimeoutError):
            async with asyncio.timeout(within_s):
                await self._waiting.join()

    async def run(self) -> None:
        """Judges until it is cancelled."""
        while True:
            if self._waiting.qsize() < BATCH_MAX:
                await asyncio.sleep(self._collect_s)
            first, place = await self._waiting.get()
            batch = [first, *self._next(BATCH_MAX - 1)]
            self._oldest_s = next((work.time_s for work in batch if isinstance(work, Now)), inf)
            await self._judge([*self._own_pace(place), *batch])
            self._oldest_s = inf
            self._look_at_pace(batch)
            for _ in batch:
                self._waiting.task_done()

    def finish(self, within_s: float) -> None:
        """After the end of `run`, however it ended: judges and tells what is left, while there is time."""
        self._closed = True
        end_s = self._clock.now() + within_s
        while batch := self._next(LAST_BATCH_MAX):
            if self._clock.now() <= end_s:
                self._tell(self._process(batch))
            else:
                for work in batch:
                    self._lose("no time at the end", work)

    def _next(self, most: int) -> list[Work]:
        return [self._waiting.get_nowait()[0] for _ in range(min(most, self._waiting.qsize()))]

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

    def _lose(self, cause: str, work: Work) -> None:
        self.lost[cause] += len(work.readings) if isinstance(work, Arrival) else 1

    def _look_at_pace(self, judged: Iterable[Work]) -> None:
        """How far behind it is: by the time that the oldest tick has waited."""
        ticks = [work.time_s for work in judged if isinstance(work, Now)]
        if ticks:
            self._behind_s = max(0.0, self._clock.now() - ticks[0] - LATENESS_S)
            self.behind_max_s = max(self.behind_max_s, self._behind_s)
            self._pace.take(ticks[-1], self._behind_s)

    def _own_pace(self, place: int) -> list[Work]:
        """How late it is as a reading of its own, in front of all that waits: else it would come as late."""
        lateness = self._pace.due(self.lost.total())
        if lateness is None:
            return []
        self._journal.reading(GATEWAY, lateness, before=place)
        return [Arrival(GATEWAY, [lateness])]


class _Pace:
    """How late the judging is, to be said once a second."""

    def __init__(self) -> None:
        self._time_s: float | None = None
        self._said_s = -inf
        self._behind_s = inf
        self._lost = 0

    def take(self, time_s: float, behind_s: float) -> None:
        self._time_s = time_s
        self._behind_s = min(self._behind_s, behind_s)

    def due(self, lost: int) -> Lateness | None:
        """The least since it was last said: a moment in which some models were learnt is no news.

        Args:
            lost: readings since the beginning.
        """
        if self._time_s is None or self._time_s - self._said_s < PACE_PERIOD_S:
            return None
        lateness = Lateness(self._time_s, self._behind_s, lost - self._lost)
        self._said_s, self._behind_s, self._lost = self._time_s, inf, lost
        return lateness
