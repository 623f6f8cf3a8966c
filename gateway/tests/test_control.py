"""The control socket, over real sockets: whose it is, who is answered, what is no request."""

import asyncio
import contextlib
import json
import os
import socket
import stat
import threading
from math import nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.verdict import Level
from drivers.mavlink.messages import CommandAck
from drivers.readings import OperatorAct, OperatorRequest
from gateway.control import local_operator
from gateway.control import server as control
from gateway.control.local_operator import LocalOperator
from gateway.control.protocol import ACTS, STATUS, Answer, Request, Said
from gateway.control.server import ControlSocket, SocketTakenError
from gateway.control.tell import NoAnswerError, ask, lines
from gateway.findings import Finding
from gateway.severity import Severity

# The protocol


@given(st.sampled_from(sorted(ACTS)), st.lists(st.text(), min_size=1), st.floats(0.0, 86_400.0))
def test_requests_come_back_whole(act, subjects, duration_s):
    request = Request(act, tuple(subjects), duration_s)
    assert Request.parse(request.line()) == request
    assert request.line().count(b"\n") == 1


said = st.builds(Said, st.floats(0.0, 1e6), st.integers(0, 7), st.text())


@given(st.builds(Answer, st.booleans(), st.tuples(st.text()), st.dictionaries(st.text(), st.text()), st.tuples(said)))
def test_answers_come_back_whole(answer):
    assert Answer.parse(answer.line()) == answer


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"", "no JSON"),
        (b"\xff\n", "no JSON"),
        (b"[" * 100_000, "no JSON"),
        (b"[]", "a list: want a JSON object"),
        (b"{}", "ask = None: want a word"),
        (b'{"ask": "stop"}', "ask = 'stop': want one of status, watch, acknowledge, accept, mute"),
        (b'{"ask": "accept"}', "accept wants a subject, or all"),
        (b'{"ask": "status", "subjects": ["dvl"]}', "status goes without a subject"),
        (b'{"ask": "accept", "subjects": "dvl"}', "subjects: want a list of words"),
        (b'{"ask": "accept", "subjects": [3]}', "subjects: want a list of words"),
        (b'{"ask": "mute", "subjects": ["dvl"], "duration_s": -1}', "want 0 to 86400 s"),
        (b'{"ask": "mute", "subjects": ["dvl"], "duration_s": NaN}', "want 0 to 86400 s"),
        (b'{"ask": "mute", "subjects": ["dvl"], "duration_s": 1' + b"0" * 400 + b"}", "too large"),
        (b'{"ask": "mute", "subjects": ["dvl"], "duration_s": true}', "want a number"),
        (b'{"ask": "status", "verbose": 1}', "unknown: verbose; want ask, subjects, duration_s"),
    ],
)
def test_what_is_no_request_is_told_why(line, why):
    with pytest.raises(ValueError, match=why.replace("[", r"\[")):
        Request.parse(line)


@given(st.binary(max_size=60))
def test_whatever_comes_is_a_value_error_at_most(line):
    for kind in (Request, Answer):
        with contextlib.suppress(ValueError):
            kind.parse(line)


# The socket


async def echo(request: Request) -> Answer:
    return Answer(True, (request.ask, *request.subjects))


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "gateway.sock"


@contextlib.asynccontextmanager
async def serving(path: Path, answer=echo):
    made = ControlSocket(path, answer)
    made.open()
    task = asyncio.create_task(made.serve())
    try:
        yield made
    finally:
        made.close()
        task.cancel()
        await asyncio.wait([task])
        assert task.cancelled()


def asked(path: Path, request: Request | None = None) -> asyncio.Future[Answer]:
    return asyncio.create_task(asyncio.to_thread(ask, path, request or Request(STATUS)))


async def test_a_request_is_answered_and_the_socket_gone_at_the_end(path):
    async with serving(path):
        assert await asked(path, Request("accept", ("T3",))) == Answer(True, ("accept", "T3"))
    assert not path.exists()
    with pytest.raises(NoAnswerError, match="no gateway runs with this configuration"):
        ask(path, Request(STATUS))


def test_it_is_its_owners_alone_from_the_first_moment_on(path, monkeypatch):
    before, modes, listen = os.umask(0), [], socket.socket.listen
    monkeypatch.setattr(
        socket.socket, "listen", lambda one, *a: (modes.append(stat.S_IMODE(path.stat().st_mode)), listen(one, *a))
    )
    try:
        made = ControlSocket(path, echo)
        made.open()
    finally:
        os.umask(before)
    made.close()
    assert modes == [0o600] and not path.exists()


def test_what_a_dead_gateway_has_left_is_replaced(path):
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    made = ControlSocket(path, echo)
    made.open()
    made.close()
    assert not path.exists()


async def test_a_living_gateway_keeps_its_socket(path):
    async with serving(path):
        with pytest.raises(
            SocketTakenError, match=r"another gateway runs with this configuration, .*: stop it first"
        ):
            ControlSocket(path, echo).open()
        assert (await asked(path)).ok
    assert not path.exists()


def test_something_else_in_its_place_is_left_alone(path):
    path.write_text("precious")
    with pytest.raises(SocketTakenError, match=r"is no socket: name another place as files\.control"):
        ControlSocket(path, echo).open()
    assert path.read_text() == "precious"


def test_a_socket_that_another_has_made_meanwhile_is_left_alone(path):
    made = ControlSocket(path, echo)
    made.open()
    path.unlink()
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(path))
        made.close()
        assert path.exists()


@pytest.mark.parametrize("folder", ["no such folder", "x" * 120])
async def test_without_a_folder_there_is_no_socket_and_it_is_told(tmp_path, folder, caplog):
    made = ControlSocket(tmp_path / folder / "gateway.sock", echo)
    made.open()
    await made.serve()
    made.close()
    assert "`gateway tell` does not work" in caplog.text


async def test_a_path_longer_than_an_address_works_too(tmp_path):
    folder = tmp_path / ("x" * 120)
    folder.mkdir()
    async with serving(folder / "gateway.sock"):
        assert (await asked(folder / "gateway.sock")).ok
        with pytest.raises(SocketTakenError):
            ControlSocket(folder / "gateway.sock", echo).open()
    assert list(folder.iterdir()) == []


async def test_garbage_is_answered_and_counted_and_the_next_request_is_served(path):
    async with serving(path) as made:
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(b"garbage\n" + Request(STATUS).line())
        refused, served = json.loads(await reader.readline()), json.loads(await reader.readline())
        writer.close()
    assert not refused["ok"] and "no JSON" in refused["lines"][0]
    assert served["ok"] and made.drops == {"no request": 1}


async def test_a_line_without_end_is_cut_off(path):
    async with serving(path) as made:
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(b"x" * 100_000)
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
        writer.close()
        await until(lambda: made.drops)
        assert (await asked(path)).ok
    assert made.drops == {"line too long": 1}


async def test_one_that_asks_nothing_is_cut_off(path, monkeypatch):
    monkeypatch.setattr(control, "IDLE_S", 0.05)
    async with serving(path) as made:
        reader, writer = await asyncio.open_unix_connection(path)
        assert await reader.read() == b""
        writer.close()
    assert made.drops == {"silent": 1}


async def test_one_that_goes_before_the_answer_disturbs_nobody(path):
    go = asyncio.Event()

    async def late(request: Request) -> Answer:
        await go.wait()
        return Answer(True, tuple("x" * 1000 for _ in range(1000)))

    async with serving(path, late):
        _, writer = await asyncio.open_unix_connection(path)
        writer.write(Request(STATUS).line())
        await writer.drain()
        writer.transport.abort()
        await asyncio.sleep(0.02)
        go.set()
        assert (await asked(path)).ok


async def test_a_gateway_that_ends_meanwhile_is_told_as_such(path):
    never = asyncio.Event()

    async def late(request: Request) -> Answer:
        await never.wait()
        return Answer(True)

    async with serving(path, late):
        asking = asked(path)
        await asyncio.sleep(0.1)
    with pytest.raises(NoAnswerError, match="has stopped before it answered"):
        await asking


def test_another_version_is_told_as_such(path):
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(path))
        other.listen()
        asking = _in_thread(lambda: ask(path, Request(STATUS)))
        channel, _ = other.accept()
        with channel:
            channel.sendall(b'{"well": 1}\n')
            assert "another version" in asking()


def test_a_gateway_that_hangs_is_told_as_such(path, monkeypatch):
    monkeypatch.setattr("gateway.control.tell.PATIENCE_S", 0.05)
    with socket.socket(socket.AF_UNIX) as hanging:
        hanging.bind(str(path))
        hanging.listen()
        with pytest.raises(NoAnswerError, match="does not answer: see its log"):
            ask(path, Request(STATUS))


def _in_thread(call):
    """Runs it in a thread; the result waits for it, and is what it raised, in words."""
    raised = []

    def run() -> None:
        try:
            call()
        except NoAnswerError as error:
            raised.append(str(error))

    thread = threading.Thread(target=run)
    thread.start()

    def result() -> str:
        thread.join(10.0)
        return raised[0]

    return result


async def until(condition, seconds: float = 5.0) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110  another connection's doing
            await asyncio.sleep(0.005)


# What the operator reads


def test_the_worst_comes_first_and_the_newest_text_last():
    answer = Answer(
        True,
        levels={"thruster 1": "NORMAL", "thruster 2": "FAULT", "link can0": "UNKNOWN", "dvl": "SUSPECT"},
        texts=(Said(300.0, 2, "T2 entangled?"), Said(4.2, 6, "All acknowledged"), Said(1.0, 99, "odd")),
    )
    assert list(lines(answer)) == [
        "thruster 2  FAULT",
        "dvl         SUSPECT",
        "thruster 1  NORMAL",
        "link can0   UNKNOWN",
        "5 min ago  CRITICAL: T2 entangled?",
        "4 s ago  INFO: All acknowledged",
        "1 s ago  99: odd",
    ]


# This machine's operator, on the way to the pipeline


class Desk:
    """What reaches the pipeline, and answers in its stead."""

    def __init__(self, takes: bool = True) -> None:
        self.takes = takes
        self.said: list[OperatorRequest] = []
        self.operator = LocalOperator(["thruster 1", "thruster 3"], self.put, lambda: 1.7e9)

    def put(self, link, request) -> bool:
        if self.takes:
            self.said.append(request)
        return self.takes

    def answer(self, *results: int, done: str = "T3 muted for 90 s") -> None:
        for result in results:
            self.operator.note(
                Finding(1.7e9, "operator", "x", Level.NORMAL, nan, f"{done} (gateway tell)", Severity.INFO)
            )
            self.operator.hear(CommandAck(OperatorAct.ACCEPT, result, 0, 0))


async def test_each_subject_is_a_reading_and_the_answers_come_back_in_their_order():
    desk = Desk()
    doing = asyncio.create_task(desk.operator.do(Request("mute", ("T3", "1"), 90.0)))
    await asyncio.sleep(0)
    assert desk.said == [
        OperatorRequest(1.7e9, OperatorAct.MUTE, 3, 90.0, 0, 0),
        OperatorRequest(1.7e9, OperatorAct.MUTE, 1, 90.0, 0, 0),
    ]
    # a ground station's
    desk.operator.note(Finding(1.7e9, "operator", "all", Level.NORMAL, nan, "All muted (255/190)", Severity.INFO))
    desk.operator.hear(CommandAck(OperatorAct.MUTE, 4, 255, 190))
    desk.answer(0)
    desk.answer(2, done="T1 is not watched here")
    assert await doing == Answer(False, ("T3 muted for 90 s", "T1 is not watched here"))


async def test_a_gateway_that_takes_nothing_more_in_says_so():
    answer = await Desk(takes=False).operator.do(Request("accept", ("all",)))
    assert answer == Answer(False, ("no answer: the gateway is too busy, or stops",))


async def test_a_late_answer_is_not_taken_for_the_next_one(monkeypatch):
    monkeypatch.setattr(local_operator, "ANSWER_S", 0.02)
    desk = Desk()
    assert not (await desk.operator.do(Request("accept", ("T1",)))).ok
    doing = asyncio.create_task(desk.operator.do(Request("accept", ("T3",))))
    await asyncio.sleep(0)
    desk.answer(0)  # the first one's, which nobody waits for any more
    desk.answer(2, done="T3 is not watched here")
    assert await doing == Answer(False, ("T3 is not watched here",))


async def test_a_subject_that_is_not_watched_never_reaches_the_pipeline():
    desk = Desk()
    answer = await desk.operator.do(Request("accept", ("T9",)))
    assert answer == Answer(False, ("subject 't9': want T1, T3, or all",)) and desk.said == []
