"""How long detectors take to learn their models anew: measured around them, for nothing in them knows a clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from gateway.channel import Channel, ThrusterJudgement
from gateway.telemetry import Refits

NONE = Refits(0, 0.0)


class Stopwatch:
    """Makes channels judge (`Pipeline`), and measures those blocks of samples in which a model was learnt anew.

    A block comes each tenth of a second, and all of it but the learning takes a hundredth of the learning.

    Args:
        now_s: source of seconds that never go back.

    Attributes:
        refits: by subject, of those that have learnt; another mapping after each.
    """

    def __init__(self, now_s: Callable[[], float] = time.perf_counter) -> None:
        self._now_s = now_s
        self.refits: Mapping[str, Refits] = {}

    def judge(self, channel: Channel[Any]) -> None:
        """Makes one judge what it has aligned."""
        begin_s = self._now_s()
        judgements = channel.judge()
        spent_s = self._now_s() - begin_s
        learnt = sum(isinstance(one, ThrusterJudgement) and one.verdict.refitted for one in judgements)
        if learnt:
            before = self.refits.get(channel.subject, NONE)
            after = Refits(before.count + learnt, before.seconds + spent_s)
            self.refits = {**self.refits, channel.subject: after}
