"""How a running gateway is, over its control socket, again and again."""

import asyncio
import contextlib
import json
import socket
import threading
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from detectors.verdict import Level
from gateway.control.protocol import WATCH, Answer, Request
from gateway.control.server import ControlSocket
from gateway.control.tell import NoAnswerError
from gateway.control.watching import Watching
from gateway.telemetry import LinkTelemetry, Refits, Said, SubjectTelemetry, Telemetry
from gateway.telemetry_table import table_of, telemetry_of

TELEMETRY = Telemetry(
    time_s=1.7e9,
    vehicle="BlueROV2 Heavy",
    running_s=12.5,
    subjects=(
        SubjectTelemetry("thruster 1", Level.FAULT, 1.4, {"speed_rpm": 800.0}, "T1 entangled?"),
        SubjectTelemetry("dvl", Level.NORMAL, 0.2),
    ),
    links=(LinkTelemetry("can0", True, "", 120, {"wrong length": 3}, 0.25, {"wrong length": 3}),),
    texts=(Said(3.0, 2, "T1 entangled?"),),
    findings={"FAULT": 1},
    drops={"pipeline": {"late": 2}},
    behind_s=0.02,
    latency_bounds_s=(0.1, 0.25),
    latency_counts=(4, 1, 0),
    latency_sum_s=0.4,
    refits={"thruster 1": Refits(3, 0.12)},
    recording="32 MB in 2 files",
)

words = st.text(max_size=5)
floats = st.floats(allow_nan=False)
counts = st.dictionaries(words, st.integers(0, 2**60), max_size=2)
subjects = st.builds(
    SubjectTelemetry, words, st.sampled_from(Level), floats, st.dictionaries(words, floats, max_size=2), words
)
links = st.builds(
    LinkTelemetry, words, st.none() | st.booleans(), words, st.integers(0, 2**60), counts, floats, counts
)
telemetries = st.builds(
    Telemetry,
    floats,
    words,
    floats,
    st.tuples(subjects),
    st.tuples(links),
    refits=st.dictionaries(words, st.builds(Refits, st.integers(0, 9), floats), max_size=2),
)


@settings(max_examples=30)
@given(telemetries)
def test_a_telemetry_comes_back_whole_over_the_wire(telemetry):
    assert Answer.parse(Answer(True, telemetry=telemetry).line()) == Answer(True, telemetry=telemetry)


@pytest.mark.parametrize("unknown", [nan, inf, -inf])
def test_what_is_not_known_comes_back_as_such(unknown):
    link = LinkTelemetry("can0", None, "", 0, {}, unknown)
    read = telemetry_of(json.loads(json.dumps(table_of(Telemetry(1.0, "ROV", 0.0, links=(link,))))))
    assert repr(read.links[0]) == repr(link)


def test_what_a_newer_gateway_tells_beside_is_left_out():
    assert telemetry_of({**table_of(TELEMETRY), "mood": "sunny"}) == TELEMETRY


@pytest.mark.parametrize(
    ("table", "why"),
    [
        (None, "telemetry = None"),
        ([], "telemetry = []"),
        ({"time_s": "noon", "vehicle": "ROV", "running_s": 1}, "time_s = 'noon'"),
        ({"time_s": 1, "vehicle": "ROV", "running_s": 1, "subjects": [{"subject": 1}]}, "subjects.0.subject = 1"),
        ({"time_s": 10**400, "vehicle": "ROV", "running_s": 1}, "time_s = 1000"),
        ({"time_s": 1, "vehicle": "ROV", "running_s": 1, "subjects": [{"level": 9}]}, "subjects.0.subject"),
        ({"time_s": 1, "vehicle": "ROV", "running_s": 1, "latency_counts": [1, 2]}, "telemetry = .*want one more"),
    ],
)
def test_what_is_no_telemetry_is_told_why(table, why):
    with pytest.raises(ValueError, match="^no telemetry: " + why.replace("[", r"\[")):
        telemetry_of(table)


# Over the socket


class Gateway:
    """One that answers in a thread of its own, and counts who came."""

    def __init__(self, path, telemetry: Telemetry | None = TELEMETRY) -> None:
        self.asked: list[Request] = []
        self._telemetry = telemetry
        self._socket = ControlSocket(path, self._answer)
        self._started, self._stop = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()))

    async def _answer(self, request: Request) -> Answer:
        self.asked.append(request)
        return Answer(True, telemetry=self._telemetry)

    async def _serve(self) -> None:
        self._socket.open()
        serving = asyncio.create_task(self._socket.serve())
        self._started.set()
        await asyncio.to_thread(self._stop.wait)
        self._socket.close()
        serving.cancel()
        await asyncio.wait([serving])

    def __enter__(self):
        self._thread.start()
        assert self._started.wait(10.0)
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join(10.0)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "gateway.sock"


def test_one_connection_serves_many_questions(path):
    with Gateway(path) as gateway, Watching(path) as watching:
        assert [watching.ask() for _ in range(3)] == [TELEMETRY] * 3
        descriptor = watching._conversation._socket.fileno()
        watching.ask()
        assert watching._conversation._socket.fileno() == descriptor
    assert gateway.asked == [Request(WATCH)] * 4


def test_a_gateway_that_is_started_again_is_watched_on(path):
    with Watching(path) as watching:
        with pytest.raises(NoAnswerError, match="no gateway runs with this configuration"):
            watching.ask()
        for _ in range(2):
            with Gateway(path):
                assert watching.ask() == TELEMETRY
        with pytest.raises(NoAnswerError, match="no gateway runs with this configuration"):
            watching.ask()


def test_one_that_was_silent_too_long_asks_on_a_new_connection(path, monkeypatch):
    monkeypatch.setattr("gateway.control.server.IDLE_S", 0.02)
    with Gateway(path), Watching(path) as watching:
        watching.ask()
        conversation = watching._conversation
        assert conversation._socket.recv(1, socket.MSG_PEEK) == b""  # it has hung up
        assert watching.ask() == TELEMETRY
        assert watching._conversation is not conversation


def test_a_gateway_of_another_version_is_told_as_such(path):
    with Gateway(path, telemetry=None), Watching(path) as watching:  # noqa: SIM117
        with pytest.raises(NoAnswerError, match="is another version: it does not say how it is"):
            watching.ask()


def test_an_answer_without_end_is_not_read_for_ever(path, monkeypatch):
    monkeypatch.setattr("gateway.control.tell.ANSWER_MAX", 1000)
    with socket.socket(socket.AF_UNIX) as endless:
        endless.bind(str(path))
        endless.listen()

        def flood() -> None:
            channel, _ = endless.accept()
            with channel, contextlib.suppress(OSError):
                channel.sendall(b"x" * 100_000)

        thread = threading.Thread(target=flood)
        thread.start()
        with Watching(path) as watching, pytest.raises(NoAnswerError, match="does not end"):
            watching.ask()
        thread.join(10.0)
