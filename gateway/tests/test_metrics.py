"""A gateway that runs, as Prometheus sees it."""

import asyncio
import socket
from urllib.request import urlopen

import pytest
from click.testing import CliRunner
from prometheus_client.parser import text_string_to_metric_families

from gateway.channel import ThrusterJudgement
from gateway.checking.metrics import check_metrics
from gateway.cli import main
from gateway.config import parse
from gateway.config_sections import Metrics
from gateway.metrics.address import HOST, url
from gateway.pipeline import Factories
from gateway.run import run
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.tests.live_vehicle import free_port, until, vehicle


@pytest.fixture
def port() -> int:
    with socket.create_server((HOST, 0)) as probe:
        return probe.getsockname()[1]


def test_check_knows_whether_the_port_is_free(port):
    settings = Metrics(port=port)
    assert check_metrics(settings).line() == f"ok       metrics: http://127.0.0.1:{port}/metrics can be served"
    with socket.create_server((HOST, port)):
        line = check_metrics(settings).line()
    assert (
        line.startswith(f"problem  metrics: port {port} cannot be had: Address already in use; ")
        and "name another as metrics.port" in line
    )


def test_the_command_check_looks_at_it(tmp_path, port):
    buses = TWO_THRUSTERS.replace('[mavlink]\nendpoint = "udpin:127.0.0.1:0"\n', "")
    path = tmp_path / "gateway.toml"
    path.write_text(
        buses.replace('link = "mavlink", servo_channel = 3', 'link = "can0", esc_index = 1')
        + f"[metrics]\nport = {port}\n"
    )
    ok = CliRunner().invoke(main, ["check", str(path)])
    assert (ok.exit_code, f"ok       metrics: {url(port)}" in ok.output) == (0, True), ok.output
    with socket.create_server((HOST, port)):
        taken = CliRunner().invoke(main, ["check", str(path)])
    assert taken.exit_code == 1 and "problem  metrics: port" in taken.output


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
