"""What a run can say of itself: at any moment, and at its end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from drivers.clock import Clock
from gateway.judging import Judging
from gateway.links import Links
from gateway.outlet import Outlet
from gateway.pipeline import Pipeline
from gateway.recording.journal import Journal
from gateway.stopwatch import Stopwatch
from gateway.summary import Summary
from gateway.telemetry import Telemetry
from gateway.telemetry_board import Counts, TelemetryBoard


class Account:
    """See the module's text; of the event loop.

    Args:
        clock: of the run.
        board: what was said.
        stopwatch: how long learning took.
        links, judging, outlet: what they count.
        elsewhere: what others throw away, by place; they go on counting.
        journal: how recording goes.
    """

    def __init__(
        self,
        clock: Clock,
        board: TelemetryBoard,
        stopwatch: Stopwatch,
        links: Links,
        judging: Judging,
        outlet: Outlet,
        elsewhere: Mapping[str, Counter[str]],
        journal: Journal,
    ) -> None:
        self._clock, self._board, self._stopwatch = clock, board, stopwatch
        self._links, self._judging, self._outlet, self._elsewhere = links, judging, outlet, elsewhere
        self._journal = journal

    def telemetry(self) -> Telemetry:
        """How it is now."""
        counts = Counts(
            links=self._links.all(),
            drops=self._drops(self._board.refused),
            behind_s=self._judging.behind_s,
            refits=self._stopwatch.refits,
            recording=self._journal.state_words(),
            recorded_bytes=self._journal.recorded_bytes,
        )
        return self._board.telemetry(self._clock.now(), counts)

    def summary(self, pipeline: Pipeline) -> Summary:
        """What it came to, once nothing is judged any more."""
        return Summary(
            duration_s=self._clock.now() - self._board.start_s,
            behind_max_s=self._judging.behind_max_s,
            frames=self._links.received(),
            drops=self._links.drops() | self._drops(pipeline.drops()),
            findings=self._outlet.counts,
            levels=pipeline.levels(),
            remarks=pipeline.remarks() | self._links.remarks(),
            unjudged=[subject for subject, newest in pipeline.newest.items() if newest is None],
        )

    def _drops(self, refused: Mapping[str, int]) -> dict[str, Counter[str]]:
        """What was thrown away elsewhere than on a link, by place and cause."""
        judged = Counter(refused) + self._outlet.lost + self._judging.lost
        return {**self._elsewhere, "pipeline": judged, "recording": self._journal.lost}
