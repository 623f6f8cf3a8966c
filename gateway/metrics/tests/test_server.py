"""The port for Prometheus: asked over the loopback, as Prometheus does, and as it does not."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator
from urllib.request import urlopen

import pytest
from prometheus_client.parser import text_string_to_metric_families

from gateway.channel import ThrusterJudgement
from gateway.checking.metrics import check_metrics
from gateway.config import parse
from gateway.config_sections import Metrics
from gateway.metrics import server as metrics
from gateway.metrics.address import HOST, url
from gateway.metrics.server import MetricsServer
from gateway.pipeline import Factories
from gateway.run import run
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.tests.live_vehicle import free_port, until, vehicle

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


def test_check_knows_whether_the_port_is_free(port):
    settings = Metrics(port=port)
    assert check_metrics(settings).line() == f"ok       metrics: http://127.0.0.1:{port}/metrics can be served"
    with socket.create_server((HOST, port)):
        line = check_metrics(settings).line()
    assert (
        line.startswith(f"problem  metrics: port {port} cannot be had: Address already in use; ")
        and "name another as metrics.port" in line
    )


# A gateway that runs


def scraped(port: int) -> dict[str, dict[tuple[str, ...], float]]:
    """Values by the values of their labels, by name of the metric."""
    with urlopen(url(port), timeout=5.0) as answer:  # noqa: S310  the loopback
        text = answer.read().decode()
    read: dict[str, dict[tuple[str, ...], float]] = {}
    for family in text_string_to_metric_families(text):
        for one in family.samples:
            read.setdefault(one.name, {})[tuple(one.labels.values())] = one.value
    return read


async def test_a_running_gateway_is_scraped_and_a_fault_shows(tmp_path, port):
    udp, stop, outcomes = free_port(), asyncio.Event(), []
    text = TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{udp}")
    config = parse(f"{text}[supervisor]\nclear_after_s = 0\n[metrics]\nport = {port}\n", tmp_path)
    async with vehicle(udp) as simulated:
        stand_ins = Factories(thruster=ThresholdDetector)
        running = asyncio.create_task(run(config, observer=outcomes.append, stop=stop, factories=stand_ins))
        await until(lambda: sum(isinstance(outcome, ThrusterJudgement) for outcome in outcomes) > 150)
        healthy = await asyncio.to_thread(scraped, port)
        simulated.share = 0.7
        await until(lambda: any(text.startswith("T2 entangled?") for _, text in simulated.texts))
        faulty = await asyncio.to_thread(scraped, port)
        stop.set()
        summary = await running
    assert healthy["gateway_level"][("thruster 2",)] == 1.0 and faulty["gateway_level"][("thruster 2",)] == 3.0
    assert faulty["gateway_score"][("thruster 2",)] > 1.0 > healthy["gateway_score"][("thruster 2",)]
    assert (
        healthy["gateway_findings_total"][("FAULT",)] == 0.0 and faulty["gateway_findings_total"][("FAULT",)] == 1.0
    )
    assert faulty["gateway_link_up"] == {("can0",): 1.0, ("mavlink",): 1.0}
    assert faulty["gateway_frames_total"][("can0",)] > healthy["gateway_frames_total"][("can0",)] > 300.0
    judged = sum(isinstance(outcome, ThrusterJudgement) for outcome in outcomes)
    assert judged >= faulty["gateway_latency_seconds_count"][()] > 150.0
    assert faulty["gateway_vehicle_info"] == {("Test vehicle",): 1.0}
    assert summary.drops["metrics"] == {}
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection(HOST, port)


async def test_a_gateway_whose_port_is_taken_watches_all_the_same(tmp_path, port, caplog):
    config = parse(f"{TWO_THRUSTERS}[metrics]\nport = {port}\n", tmp_path)
    stop = asyncio.Event()
    with socket.create_server((HOST, port)):
        running = asyncio.create_task(run(config, stop=stop, factories=Factories(thruster=ThresholdDetector)))
        await until(lambda: "no metrics: port" in caplog.text)
        stop.set()
        assert (await running).duration_s < 5.0
