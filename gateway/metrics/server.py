"""The port of the loopback at which Prometheus asks; in the event loop, where the telemetry is."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable
from http import HTTPStatus

from gateway.metrics.address import HOST, url, why
from gateway.metrics.http import Reply, reply

log = logging.getLogger("gateway")

HEAD_MAX = 8192  # bytes
# one that asks nothing for so long, or takes no answer, is gone
PATIENCE_S = 5.0
# Prometheus has one connection open at a time
TALKS_MAX = 8
RETRY_S = 10.0


class MetricsServer:
    """Serves a text to whoever asks for it on this machine.

    Args:
        port: of the loopback; where it is taken, that is told, and tried again every ten seconds.
        text: gives what is served.

    Attributes:
        drops: what was not served, by cause.
    """

    def __init__(self, port: int, text: Callable[[], bytes]) -> None:
        self._port, self._text = port, text
        self._writers: set[asyncio.StreamWriter] = set()
        self.drops: Counter[str] = Counter()

    async def serve(self) -> None:
        """Answers until it is cancelled."""
        async with asyncio.TaskGroup() as talks:

            def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                if len(self._writers) == TALKS_MAX:
                    self.drops["too many at once"] += 1
                    writer.close()
                    return
                self._writers.add(writer)
                talks.create_task(self._talk(reader, writer), name="metrics talk")

            server = await self._started(talk)
            try:
                await asyncio.Event().wait()
            finally:
                server.close()
                for writer in tuple(self._writers):  # a talk that is cancelled before it begins closes nothing
                    writer.close()

    async def _started(self, talk: Callable[[asyncio.StreamReader, asyncio.StreamWriter], None]) -> asyncio.Server:
        told = False
        while True:
            try:
                server = await asyncio.start_server(talk, HOST, self._port, limit=HEAD_MAX)
            except OSError as error:
                if not told:
                    log.warning("no metrics: port %d cannot be had (%s): set metrics.port", self._port, why(error))
                told = True
                await asyncio.sleep(RETRY_S)
            else:
                log.info("metrics at %s", url(self._port))
                return server

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            async with asyncio.timeout(PATIENCE_S):
                answer = await self._answer(reader)
                if answer is not None:
                    writer.write(answer.encoded())
                writer.close()
                await writer.wait_closed()
        except TimeoutError:
            self.drops["silent"] += 1
        except ConnectionError:
            self.drops["connection lost"] += 1
        finally:
            self._writers.discard(writer)
            writer.transport.abort()  # of one that takes no answer

    async def _answer(self, reader: asyncio.StreamReader) -> Reply | None:
        """None: there was no whole request."""
        try:
            head = await reader.readuntil(b"\r\n\r\n")
        except asyncio.IncompleteReadError:
            self.drops["connection lost"] += 1
            return None
        except asyncio.LimitOverrunError:
            self.drops["head too long"] += 1
            return None
        try:
            answer = reply(head, self._text)
        except Exception as error:  # whatever cannot be shown: the watch goes on
            log.error("metrics cannot be shown: %r", error)
            answer = Reply(HTTPStatus.INTERNAL_SERVER_ERROR, b"see the log\n", cause="not to be shown")
        if answer.cause:
            self.drops[answer.cause] += 1
        return answer
