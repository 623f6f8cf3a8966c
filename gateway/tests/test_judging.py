"""Judging in its thread: everything once and in order, however it ends; nothing is lost or late unseen."""

import asyncio
import threading
import time
from itertools import pairwise

import pytest

from drivers.readings import Lateness, ThrusterCommand, ThrusterReport
from gateway import judging
from gateway.channel import ThrusterJudgement
from gateway.judging import Judging
from gateway.pipeline import Arrival, Factories, Now, Pipeline
from gateway.tests.conftest import FULL_RPM, ThresholdDetector

START_S = 1.7e9
PERIOD_S = 0.02


class SlowDetector(ThresholdDetector):
    """Takes its time, and notices when it is entered twice at once."""

    delay_s = 0.01

    def __init__(self, *args: object) -> None:
        super().__init__(*args)
        self._busy = threading.Lock()
        self.times_s: list[float] = []

    def update(self, sample):
        assert self._busy.acquire(blocking=False), "two threads in one detector"
        time.sleep(self.delay_s)
        self.times_s.append(sample.time_s)
        self._busy.release()
        return super().update(sample)


class SteppedClock:
    """The time that a test says."""

    now_s = START_S

    def now(self) -> float:
        return self.now_s


class Bench:
    """Judging, fed with a thruster's readings, and what came of it."""

    def __init__(self, config) -> None:
        self.clock = SteppedClock()
        self.detectors: list[SlowDetector] = []
        self.pipeline = Pipeline(config, Factories(thruster=self._make))
        self.recorded: list = []
        self.told: list = []
        self.judging = Judging(self.pipeline, self.clock, self.recorded.extend, self.told.extend, collect_s=0.0)
        self._count = 0

    def _make(self, *args: object) -> SlowDetector:
        self.detectors.append(SlowDetector(*args))
        return self.detectors[-1]

    def feed(self, periods: int) -> None:
        for _ in range(periods):
            time_s = START_S + PERIOD_S * self._count
            readings = [ThrusterCommand(time_s, 1, 0.5), ThrusterReport(time_s + 0.004, 1, 0.5 * FULL_RPM)]
            self.judging.put(Arrival("can0", readings))
            self._count += 1

    def check_all_judged_once(self) -> None:
        assert self.pipeline.drops() == {}
        times_s = self.detectors[0].times_s
        steps = [round((later - earlier) / PERIOD_S) for earlier, later in pairwise(times_s)]
        assert set(steps) == {1} and len(times_s) >= self._count - 2
        told = [outcome.sample.time_s for outcome in self.told if isinstance(outcome, ThrusterJudgement)]
        assert told == times_s
        assert self.recorded == self.told


@pytest.fixture
def bench(config) -> Bench:
    return Bench(config)


async def a_batch_under_way(bench: Bench) -> asyncio.Task:
    running = asyncio.create_task(bench.judging.run())
    bench.feed(20)
    async with asyncio.timeout(5.0):
        while not bench.detectors[0].times_s:  # noqa: ASYNC110  it is another thread's doing
            await asyncio.sleep(0.002)
    assert len(bench.detectors[0].times_s) < 15
    bench.feed(10)
    return running


async def test_close_waits_until_all_is_judged_and_takes_no_more(bench):
    running = await a_batch_under_way(bench)
    closing = asyncio.create_task(bench.judging.close(5.0))
    await asyncio.sleep(0.0)
    bench.judging.put(lambda: pytest.fail("taken after close"))
    await closing
    bench.check_all_judged_once()
    running.cancel()
    await asyncio.wait([running])


@pytest.mark.parametrize("times", [1, 2])
async def test_cancelled_in_the_middle_of_a_batch_nothing_is_lost_or_judged_by_two(bench, times):
    running = await a_batch_under_way(bench)
    for _ in range(times):
        running.cancel()
        await asyncio.sleep(0.01)
    await asyncio.wait([running])
    assert running.cancelled()
    bench.judging.finish(5.0)
    bench.check_all_judged_once()


async def test_an_error_of_the_pipeline_ends_judging(bench):
    def fail() -> list:
        raise ZeroDivisionError

    running = asyncio.create_task(bench.judging.run())
    bench.judging.put(fail)
    with pytest.raises(ZeroDivisionError):
        await running


async def test_calls_have_their_turn_between_events(bench):
    bench.feed(10)
    bench.judging.put(lambda: ["in turn"])
    bench.feed(10)
    bench.judging.finish(5.0)
    assert 8 <= bench.told.index("in turn") <= 12 and len(bench.told) > 18


def paces(bench: Bench, monkeypatch) -> list[Lateness]:
    """What the pipeline is told of its own lateness."""
    told, take = [], bench.pipeline.take

    def listen(events):
        events = list(events)
        told.extend(event.readings[0] for event in events if isinstance(event, Arrival) and event.link == "gateway")
        return take(events)

    monkeypatch.setattr(bench.pipeline, "take", listen)
    return told


async def test_how_late_it_is_is_said_once_a_second_and_before_all_that_waits(bench, monkeypatch):
    told = paces(bench, monkeypatch)
    running = asyncio.create_task(bench.judging.run())
    for behind_s in (0.2, 0.7, 1.2, 1.5, 0.1, 0.1, 1.0):
        bench.judging.advance(bench.clock.now())
        bench.clock.now_s += behind_s
        await asyncio.sleep(0.03)
    running.cancel()
    await asyncio.wait([running])
    starts_s = [round(lateness.time_s - START_S + judging.LATENESS_S, 3) for lateness in told]
    assert [(start_s, round(lateness.behind_s, 3)) for start_s, lateness in zip(starts_s, told, strict=True)] == [
        (0.0, 0.2),
        (2.1, 0.7),  # the least of those since: it has lasted
        (3.6, 0.1),
    ]
    assert bench.judging.behind_max_s == pytest.approx(1.5)


async def test_how_far_behind_it_is_shows_while_a_batch_takes_its_time(bench):
    bench.judging.advance(bench.clock.now())
    running = await a_batch_under_way(bench)
    bench.clock.now_s += 3.0  # the detector still works
    assert bench.judging.behind_s == pytest.approx(3.0)
    await bench.judging.close(5.0)
    assert bench.judging.behind_s == pytest.approx(3.0)
    running.cancel()
    await asyncio.wait([running])


async def test_what_finds_no_room_is_counted_and_told(config, monkeypatch):
    monkeypatch.setattr(judging, "WAITING_MAX", 5)
    bench = Bench(config)
    told = paces(bench, monkeypatch)
    running = asyncio.create_task(bench.judging.run())
    assert bench.judging.put(Now(START_S))
    bench.feed(8)
    assert not bench.judging.put(Now(START_S))
    assert bench.judging.lost == {"machine too slow": 9}  # four times two readings, and a tick
    await asyncio.sleep(0.1)
    bench.judging.put(Now(START_S + 1.0))
    await bench.judging.close(5.0)
    assert not bench.judging.put(Now(START_S + 2.0)) and bench.judging.lost.total() == 9
    running.cancel()
    await asyncio.wait([running])
    assert [lateness.lost for lateness in told] == [9]


async def test_batches_are_bounded_so_that_a_stop_is_not_held_up(bench, monkeypatch):
    monkeypatch.setattr(judging, "BATCH_MAX", 7)
    sizes, take = [], bench.pipeline.take
    monkeypatch.setattr(bench.pipeline, "take", lambda events: sizes.append(len(events)) or take(events))
    running = asyncio.create_task(bench.judging.run())
    bench.feed(30)
    await bench.judging.close(5.0)
    assert sizes == [7, 7, 7, 7, 2]
    bench.check_all_judged_once()
    running.cancel()
    await asyncio.wait([running])


async def test_close_comes_back_when_its_time_is_over(bench):
    running = await a_batch_under_way(bench)
    start_s = time.monotonic()
    await bench.judging.close(0.02)
    assert time.monotonic() - start_s < 0.2
    running.cancel()
    await asyncio.wait([running])
    bench.judging.finish(5.0)
    bench.check_all_judged_once()


def test_what_is_left_at_the_end_is_judged_only_while_there_is_time(bench, monkeypatch):
    monkeypatch.setattr(judging, "LAST_BATCH_MAX", 10)
    bench.feed(30)
    process = bench.judging._process

    def slow(batch):
        bench.clock.now_s += 0.4
        return process(batch)

    monkeypatch.setattr(bench.judging, "_process", slow)
    bench.judging.finish(0.5)
    assert bench.judging.lost == {"no time at the end": 20}
    assert 18 <= len(bench.detectors[0].times_s) <= 20
