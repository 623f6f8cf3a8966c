"""What the gateway has recorded of itself gives the findings of its run again, to the byte."""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path

import pytest

from drivers.clock import Clock
from gateway.config import load
from gateway.control.protocol import Answer, Request
from gateway.pipeline import Factories
from gateway.recording.reading import read_about
from gateway.recording.recorder import CHUNK_S
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.replay.result import ReplayResult
from gateway.replay.session import Terms, replay
from gateway.replay.window import Instant, Window
from gateway.tests.conftest import CruiseDetector, GroundSpeedDetector, ThresholdDetector
from hil_tests.playback.play import play
from hil_tests.playback.settings import CONFIG, FINDINGS
from hil_tests.playback.stage import Opened, Stage
from hil_tests.playback.virtual_time import START_S, VirtualTimeLoop, run_in_virtual_time
from hil_tests.playback.way import Way
from hil_tests.scenario.document import Scenario
from hil_tests.vcan.interface import INTERFACE

# detectors that learn nothing: the way from a byte to a finding is what is at stake
FAKES = Factories(ThresholdDetector, GroundSpeedDetector, CruiseDetector)
STATE, FOLDER = "vehicle.state", "recordings"
# parts of seconds, so that there are several
RECORDING = {"enabled": True, "folder": FOLDER, "file_max_minutes": 0.1, "keep_free_mb": 0}
SURVEY = {"style": "surveying", "mode": "MANUAL", "course": {"headings_deg": [0, 90, 180, 270], "leg_s": 5}}
SECONDS = 22.0
TROUBLED = Scenario(
    vehicle="bench_rov",
    seed=1,
    duration_s=SECONDS,
    mission=SURVEY,
    gateway={"settings": {"recording": RECORDING}},
    faults=[
        {"at_s": 1, "duration_s": 2, "subject": "can0", "failure": "delay", "delay_s": 0.003, "jitter_s": 0.03},
        {"at_s": 2, "duration_s": 2, "subject": "mavlink", "failure": "garbage", "share": 0.3},
        {"at_s": 3, "duration_s": 3, "subject": "mavlink", "failure": "loss", "share": 0.3},
        {"at_s": 5, "duration_s": 4, "subject": "thruster 3 rpm", "failure": "off"},
        {"at_s": 11, "duration_s": 6, "subject": "mavlink", "failure": "cut"},
        {"at_s": 16, "subject": "thruster 1", "failure": "entangled", "share": 0.6},
    ],
)


class RecordedStage(Stage):
    """A play whose gateway goes on from what the run before has left, and whose operator speaks to it."""

    acts = ((7.0, Request("mute", ("thruster 3",), 60.0)), (9.0, Request("accept", ("all",))))

    def _configured(self, meeting):
        state = self._folder / STATE
        left = state.read_bytes() if state.exists() else b""
        config, key = super()._configured(meeting)
        if left:
            state.write_bytes(left)
        return config, key

    async def _play_simulated(self, opened: Opened, lead_s: float = 0.0) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(self._operator(opened))
            group.create_task(self._parts(opened))
            await super()._play_simulated(opened, lead_s)

    async def _operator(self, opened: Opened) -> None:
        begin_s = opened.clock.now()
        for at_s, request in self.acts:
            await asyncio.sleep(begin_s + at_s - opened.clock.now())
            reader, writer = await asyncio.open_unix_connection(opened.config.files.control)
            writer.write(request.line())
            assert Answer.parse(await reader.readline()).ok
            writer.close()

    async def _parts(self, opened: Opened) -> None:
        """Files end by the clock of the run, which is done here before the disk is looked at: it has to wait."""
        begin_s = opened.clock.now()
        for at_s in (1.0, 8.0, 15.0):
            await asyncio.sleep(begin_s + at_s - opened.clock.now())
            wait_for_disk(opened.config.recording.folder)


def wait_for_disk(folder: Path) -> None:
    """Until the recorder has written something more."""
    before, end_s = size_of(folder), time.monotonic() + 5 * CHUNK_S
    while size_of(folder) == before and time.monotonic() < end_s:
        time.sleep(0.02)


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.glob("*.mcap"))


def run(folder: Path, begin_s: float = 0.0) -> list[str]:
    """Lines of the findings of a run that begins so long after the usual time."""
    folder.mkdir(exist_ok=True)
    stage = RecordedStage(TROUBLED, folder / "scenario.yaml", folder, lambda _: None, FAKES)

    async def later(clock: Clock) -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualTimeLoop)
        await stage.in_memory(Clock(lambda: START_S + begin_s + round(loop.time(), 6), loop.time))

    run_in_virtual_time(later)
    return (folder / FINDINGS).read_text().splitlines()


def recordings(folder: Path) -> list[Path]:
    return sorted((folder / FOLDER).glob("*.mcap"))


def replayed(
    folder: Path, logs: list[Path], out: Path, factories=FAKES, terms=None
) -> tuple[list[str], ReplayResult]:
    config = load(folder / CONFIG)
    inputs = [log_input(str(log), config.links()) for log in logs]
    result = replay(config, reels(inputs, config), out, factories=factories, terms=terms)
    return out.read_text().splitlines(), result


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folder, and the findings of two runs, of which the second goes on from the first."""
    folder = tmp_path_factory.mktemp("runs") / "play"
    return folder, run(folder), run(folder, SECONDS + 1.0)


def of_run(folder: Path, number: int) -> list[Path]:
    runs = sorted({read_about(path).started_s for path in recordings(folder)})
    return [path for path in recordings(folder) if read_about(path).started_s == runs[number]]


@pytest.mark.parametrize("number", [0, 1])
def test_the_findings_are_those_of_the_run_to_the_byte(runs, tmp_path, number):
    folder, *found = runs
    lines, result = replayed(folder, of_run(folder, number), tmp_path / "out")
    assert lines == found[number]
    assert f"the {len(lines)} findings are those of the run itself" in "\n".join(result.lines())


def test_there_was_something_to_find(runs):
    folder, first, second = runs
    assert {json.loads(line)["detector"] for line in first} >= {"link", "signal", "thruster", "operator"}
    assert any('"thruster 1", "level": "FAULT"' in line for line in first)
    assert any('"link mavlink", "level": "SUSPECT"' in line for line in first)
    assert len(of_run(folder, 0)) > 2
    about = read_about(of_run(folder, 1)[0])
    assert about.state and about.resumed
    assert first != second


def test_both_runs_after_each_other_in_any_order(runs, tmp_path):
    folder, first, second = runs
    lines, _ = replayed(folder, recordings(folder)[::-1], tmp_path / "out")
    assert lines == first + second


def test_a_later_part_alone_goes_on_from_what_was_known_then(runs, tmp_path):
    folder, *_ = runs
    lines, result = replayed(folder, of_run(folder, 1)[-1:], tmp_path / "out")
    assert result.judged
    assert result.levels["autopilot"].name == "NORMAL"
    assert not any('"autopilot"' in line for line in lines)  # that it is well was known


def test_a_window_tells_what_is_found_in_it_and_nothing_else(runs, tmp_path):
    folder, first, _ = runs
    terms = Terms(Window(Instant.of("8.5"), Instant.of("17")))
    lines, result = replayed(folder, of_run(folder, 0), tmp_path / "out", terms=terms)
    begin_s = result.begin_s or 0.0
    assert lines == [line for line in first if 8.5 <= json.loads(line)["time_s"] - begin_s < 17.0]
    assert 0 < len(lines) < len(first)
    assert result.levels_before["thruster 3 esc"].name == "SUSPECT"


def test_what_is_left_after_a_pulled_plug_gives_what_was_found_until_then(runs, tmp_path):
    folder, first, _ = runs
    (*whole, last) = of_run(folder, 0)
    torn = tmp_path / last.name
    torn.write_bytes(last.read_bytes()[: last.stat().st_size // 2])
    lines, result = replayed(folder, [*whole, torn], tmp_path / "out")
    assert lines == first[: len(lines)]
    assert any("no end" in line for line in result.logs[str(torn)])


def test_what_is_damaged_within_is_passed_over_and_told(runs, tmp_path):
    folder, *_ = runs
    damaged = tmp_path / "damaged.mcap"
    first, middle, *rest = of_run(folder, 0)
    data = bytearray(middle.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 2000] = bytes(2000)
    damaged.write_bytes(data)
    _, result = replayed(folder, [first, damaged, *rest], tmp_path / "out")
    assert result.judged
    assert any("lost" in line for line in result.logs[str(damaged)])


def test_one_link_of_it_beside_another_log(runs, tmp_path):
    """By their times: to the byte it is not promised."""
    folder, *_ = runs
    config = load(folder / CONFIG)
    named = [*(f"can0={path}" for path in of_run(folder, 1)), f"mavlink={folder / 'heard.tlog'}"]
    inputs = [log_input(one, config.links()) for one in named]
    result = replay(config, reels(inputs, config), tmp_path / "out", factories=FAKES)
    assert {"link can0", "link mavlink", "thruster 3 esc"} <= set(result.levels)
    assert result.duration_s == pytest.approx(SECONDS, abs=0.5)


def test_one_link_of_it_alone(runs, tmp_path):
    folder, *_ = runs
    config = load(folder / CONFIG)
    inputs = [log_input(f"can0={path}", config.links()) for path in of_run(folder, 1)]
    result = replay(config, reels(inputs, config), tmp_path / "out", factories=FAKES)
    assert result.levels["thruster 3 rpm"].name == "NORMAL"
    assert "autopilot" not in result.levels


def test_where_the_first_part_is_gone_it_is_said_why_the_findings_are_others(runs, tmp_path):
    folder, *_ = runs
    _, result = replayed(folder, of_run(folder, 0)[1:], tmp_path / "out")
    assert "and what came before part 2 is not there" in "\n".join(result.lines())


@pytest.mark.vcan
@pytest.mark.timeout(300)
def test_of_a_run_on_a_real_bus_too(tmp_path):
    """In its own time; frames are stamped by the kernel."""
    scenario, way = TROUBLED.model_copy(update={"duration_s": 12.0}), Way(channel=INTERFACE, program=False)
    outcome = play(scenario, tmp_path / "scenario.yaml", tmp_path / "play", way, factories=FAKES)
    assert outcome.broken is None
    lost = [line for line in outcome.gateway_lines if "machine too slow" in line or "no time at the end" in line]
    if lost:  # nobody wrote down which
        pytest.skip(f"the gateway itself has not judged all: {lost[0]}")
    folder = tmp_path / "play"
    lines, _ = replayed(folder, recordings(folder), tmp_path / "out")
    assert lines == (folder / FINDINGS).read_text().splitlines()
    assert any('"thruster 3 esc", "level": "SUSPECT"' in line for line in lines)
