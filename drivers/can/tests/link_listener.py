"""Runs a link for the length of a test and keeps what came out of it."""

import asyncio
import contextlib
from dataclasses import dataclass, field


@dataclass
class Heard:
    """What came out of a link."""

    frames: list = field(default_factory=list)
    states: list = field(default_factory=list)

    def on_frames(self, frames):
        self.frames += frames.frames()

    def on_state(self, state):
        self.states.append((state.up, state.detail))


async def until(condition, seconds=5.0):
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110  a condition of any kind
            await asyncio.sleep(0.002)


@contextlib.asynccontextmanager
async def running(link):
    heard = Heard()
    task = asyncio.create_task(link.run(heard.on_frames, heard.on_state))
    try:
        yield heard
        assert not task.done(), task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
