"""`gateway tell` to a gateway that runs, and where there is none."""

import asyncio
import contextlib
import logging
import re
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.channel import ThrusterJudgement
from gateway.cli import main
from gateway.config import load
from gateway.control.protocol import Answer, Request
from gateway.control.server import SocketTakenError
from gateway.control.tell import ask
from gateway.control.watching import Watching
from gateway.findings import Finding
from gateway.pipeline import Factories
from gateway.run import run
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.tests.live_vehicle import Vehicle, free_port, until, vehicle

STAND_INS = Factories(thruster=ThresholdDetector)


@pytest.fixture
def written(tmp_path) -> Path:
    path = tmp_path / "gateway.toml"
    text = TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{free_port()}")
    path.write_text(text + "[supervisor]\nclear_after_s = 0\n")
    return path


@contextlib.asynccontextmanager
async def watched(written: Path) -> AsyncIterator[tuple[Vehicle, list]]:
    """A gateway that has learnt, and what it says."""
    config, stop, outcomes = load(written), asyncio.Event(), []
    async with vehicle(int(config.mavlink.endpoint.rpartition(":")[2])) as simulated:
        running = asyncio.create_task(run(config, observer=outcomes.append, stop=stop, factories=STAND_INS))
        await until(lambda: sum(isinstance(outcome, ThrusterJudgement) for outcome in outcomes) > 150)
        try:
            yield simulated, outcomes
        finally:
            stop.set()
            await running


async def asked(path: Path, *request: object) -> Answer:
    return await asyncio.to_thread(ask, path, Request(*request))


def told(*arguments: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["tell", *map(str, arguments)])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


def faults(outcomes: list) -> list[str]:
    return [one.subject for one in outcomes if isinstance(one, Finding) and one.level.name == "FAULT"]


async def test_status_and_all_three_acts(written, caplog):
    caplog.set_level(logging.INFO, "gateway")
    control = written.parent / "gateway.sock"
    async with watched(written) as (simulated, outcomes):
        healthy = await asked(control, "status")
        assert healthy.levels["thruster 2"] == "NORMAL" and healthy.levels["autopilot"] in ("NORMAL", "UNKNOWN")
        simulated.share = 0.7
        await until(lambda: faults(outcomes))
        faulty = await asked(control, "status")
        assert faulty.levels["thruster 2"] == "FAULT"
        assert faulty.texts[-1].text.startswith("T2 entangled?") and faulty.texts[-1].age_s < 5.0
        assert await asked(control, "acknowledge", ("T2",)) == Answer(True, ("T2 acknowledged",))
        assert await asked(control, "mute", ("all",), 120.0) == Answer(True, ("All muted for 2 min",))
        assert await asked(control, "accept", ("T2", "T1")) == Answer(
            True, ("T2 accepted as it is", "T1 accepted as it is")
        )
        assert (await asked(control, "status")).levels["thruster 2"] != "FAULT"
        assert not (await asked(control, "accept", ("dvl",))).ok
    assert "operator: accept T2, T1" in caplog.messages
    cleared = [one.text for one in outcomes if isinstance(one, Finding) and one.subject == "thruster 2"]
    assert "T2 fault cleared: operator accepted" in cleared


async def test_whoever_watches_sees_a_fault_come(written):
    with Watching(written.parent / "gateway.sock") as watching:
        async with watched(written) as (simulated, outcomes):
            healthy = await asyncio.to_thread(watching.ask)
            simulated.share = 0.7
            await until(lambda: faults(outcomes))
            faulty = await asyncio.to_thread(watching.ask)
    level = {one.subject: one.level.name for one in healthy.subjects}
    assert level["thruster 1"] == level["thruster 2"] == "NORMAL"
    thruster = next(one for one in faulty.subjects if one.subject == "thruster 2")
    assert (thruster.level.name, thruster.text) == ("FAULT", faulty.texts[-1].text)
    assert thruster.values["residual_rpm"] < -100.0 and faulty.findings["FAULT"] == 1
    can0, mavlink = faulty.links
    assert (can0.name, can0.up, mavlink.name, mavlink.up) == ("can0", True, "mavlink", True)
    assert can0.received > healthy.links[0].received > 300 and mavlink.received > 50
    assert sum(faulty.latency_counts) > sum(healthy.latency_counts) > 150 and 0.0 <= faulty.behind_s < 5.0
    assert 0.0 < healthy.running_s < faulty.running_s and {"control", "pipeline"} <= set(faulty.drops)


async def test_the_command_prints_what_is_answered(written):
    async with watched(written):
        code, text = await asyncio.to_thread(told, written, "status")
        assert code == 0 and re.search("^thruster 1 +NORMAL$", text, re.MULTILINE) and "INFO: Watching " in text
        assert await asyncio.to_thread(told, written, "mute", "thruster", "1", "--minutes", "5") == (
            0,
            "T1 muted for 5 min\n",
        )
        with pytest.raises(SocketTakenError, match="another gateway runs with this configuration"):
            await run(load(written), factories=STAND_INS)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("status",), "no gateway runs with this configuration (nobody listens at "),
        (("accept", "T1"), "no gateway runs with this configuration"),
        (("accept",), "accept what? Want T1, T2, or all"),
        (("accept", "T7"), "subject 't7': want T1, T2, or all"),
        (("accept", "dvl"), "subject 'dvl': want T1, T2, or all"),
        (("status", "T1"), "status goes without a subject"),
        (("accept", "T1", "--minutes", "3"), "--minutes goes with mute, not with accept"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(written, arguments, said):
    code, text = told(written, *arguments)
    assert code == 1 and said in text and text.count("\n") == 1


@pytest.mark.parametrize(
    "arguments", [("stop",), ("mute", "T1", "--minutes", "0"), ("mute", "T1", "--minutes", "1e9")]
)
def test_what_is_no_command_is_said_with_those_that_are(written, arguments):
    code, text = told(written, *arguments)
    assert code == 2 and "Error: Invalid value" in text


async def test_check_knows_of_a_gateway_that_runs(written):
    async with watched(written):
        result = await asyncio.to_thread(CliRunner().invoke, main, ["check", str(written)])
        assert result.exit_code == 1
        assert "problem  gateway: one runs with this configuration, and holds its links; stop it" in result.output
        assert "does not open" not in result.output
