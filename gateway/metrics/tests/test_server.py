"""The port for Prometheus: asked over the loopback, as Prometheus does, and as it does not."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator

import pytest

from gateway.metrics import server as metrics
from gateway.metrics.address import HOST
from gateway.metrics.server import MetricsServer

SCRAPE = b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture
def port() -> int:
    with socket.create_server((HOST, 0)) as probe:
        return probe.getsockname()[1]


@contextlib.asynccontextmanager
async def serving(port: int) -> AsyncIterator[MetricsServer]:
    server = MetricsServer(port, lambda: b"level 1\n")
    task = asyncio.create_task(server.serve())
    try:
        yield server
    finally:
        task.cancel()
        await asyncio.wait([task], timeout=1.0)
        assert task.cancelled()


async def connected(port: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    async with asyncio.timeout(5.0):
        while True:
            with contextlib.suppress(ConnectionRefusedError):
                return await asyncio.open_connection(HOST, port)
            await asyncio.sleep(0.005)


async def asked(port: int, request: bytes, ends: bool = False) -> bytes:
    reader, writer = await connected(port)
    with contextlib.suppress(ConnectionError):
        writer.write(request)
        if ends:
            writer.write_eof()
    try:
        async with asyncio.timeout(5.0):
            return await reader.read()
    except ConnectionError:
        return b""
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


async def test_it_is_served_again_and_again_in_pieces_too(port):
    async with serving(port) as server:
        for _ in range(3):
            assert (await asked(port, SCRAPE)).endswith(b"\r\n\r\nlevel 1\n")
        reader, writer = await connected(port)
        for byte in SCRAPE:
            writer.write(bytes([byte]))
            await asyncio.sleep(0)
        assert (await reader.read()).endswith(b"level 1\n")
        writer.close()
        await writer.wait_closed()
    assert not server.drops
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection(HOST, port)


@pytest.mark.parametrize(
    ("request_bytes", "ends", "cause"),
    [
        (b"GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n", False, "asked by another name than localhost"),
        (b"garbage\r\n\r\n", False, "no request of HTTP"),
        (b"GET /metrics HTTP/1.1\r\n", True, "connection lost"),
        (b"X" * 100_000, False, "head too long"),
        (b"GET", False, "silent"),
    ],
)
async def test_what_is_no_scrape_is_counted_and_the_next_one_served(port, monkeypatch, request_bytes, ends, cause):
    monkeypatch.setattr(metrics, "PATIENCE_S", 0.2)
    async with serving(port) as server:
        assert b"level" not in await asked(port, request_bytes, ends)
        assert [(key.startswith(cause), count) for key, count in server.drops.items()] == [(True, 1)]
        assert (await asked(port, SCRAPE)).endswith(b"level 1\n")


async def test_one_that_takes_no_answer_is_let_go(port, monkeypatch):
    monkeypatch.setattr(metrics, "PATIENCE_S", 0.1)
    server = MetricsServer(port, lambda: b"x" * 20_000_000)
    task = asyncio.create_task(server.serve())
    _, writer = await connected(port)
    writer.transport.pause_reading()
    writer.write(SCRAPE)
    async with asyncio.timeout(5.0):
        while not server.drops:  # noqa: ASYNC110  the other end's doing
            await asyncio.sleep(0.01)
    writer.transport.abort()
    assert server.drops == {"silent": 1} and not task.done()
    task.cancel()
    await asyncio.wait([task])


async def test_what_cannot_be_shown_ends_nothing(port, caplog):
    texts = iter([b"level 1\n"])
    server = MetricsServer(port, lambda: next(texts))
    task = asyncio.create_task(server.serve())
    assert (await asked(port, SCRAPE)).endswith(b"level 1\n")
    assert (await asked(port, SCRAPE)).startswith(b"HTTP/1.1 500 ")
    assert not task.done() and server.drops == {"not to be shown": 1} and "StopIteration" in caplog.text
    task.cancel()
    await asyncio.wait([task])


async def test_many_at_once_are_turned_away(port, monkeypatch):
    monkeypatch.setattr(metrics, "TALKS_MAX", 2)
    async with serving(port) as server:
        waiting = [await connected(port) for _ in range(2)]
        assert await asked(port, SCRAPE) == b"" and server.drops == {"too many at once": 1}
        for reader, writer in waiting:
            writer.write(SCRAPE)
            assert (await reader.read()).endswith(b"level 1\n")
            writer.close()
            await writer.wait_closed()
        assert (await asked(port, SCRAPE)).endswith(b"level 1\n")


async def test_an_end_waits_for_nobody(port):
    async with serving(port):
        _, writer = await connected(port)
        writer.write(b"GET")
        await asyncio.sleep(0.02)
    writer.close()


async def test_a_port_that_is_taken_is_told_once_and_had_when_it_is_free(port, monkeypatch, caplog):
    monkeypatch.setattr(metrics, "RETRY_S", 0.01)
    with socket.create_server((HOST, port)) as other:
        async with serving(port):
            await asyncio.sleep(0.1)
            other.close()
            assert (await asked(port, SCRAPE)).endswith(b"level 1\n")
    (told,) = [record.message for record in caplog.records if record.levelno == logging.WARNING]
    assert told == f"no metrics: port {port} cannot be had (Address already in use): set metrics.port"
