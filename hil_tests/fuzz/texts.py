"""What people and programs write to the gateway: its configuration, and the control socket of `gateway tell`."""

from __future__ import annotations

from contextlib import suppress
from importlib.resources import files

from gateway.config import load
from gateway.control.protocol import Answer, Request
from gateway.control.subject_words import subjects_named
from gateway.control.tell import lines
from gateway.problems import ConfigError
from gateway.telemetry import Said
from hil_tests.fuzz.files import as_file
from hil_tests.fuzz.target import Target, require

_SUBJECTS = ("thruster 1", "thruster 2", "vehicle", "dvl", "depth sensor", "link can0")
_LONG = b"9" * 5000  # Python turns no number of more than 4300 digits
_LARGE = b"9" * 400  # nor one of more than 308 into a float
_WORDS = (b"nan", b"inf", b"-1", b'""', b"[]", b"{}", b"\\u0000", b"true", b"1979-05-27", b"[[can]]\n")
CONFIG_TOKENS = (*_WORDS, _LONG, _LARGE, b"0x" + b"f" * 4000, b"x" * 5000)
REQUEST_TOKENS = (b"NaN", b"Infinity", b"1e999", b"null", b"[[", b'{"', b"\\ud800", b"true", _LONG, _LARGE)


def text_targets() -> list[Target]:
    """Of the configuration and of the control socket."""
    return [
        Target("config", "the configuration: read, or refused with all its problems", _load, examples, CONFIG_TOKENS),
        Target("request", "what `gateway tell` asks over the control socket", _ask, _requests, REQUEST_TOKENS),
        Target("answer", "what the gateway answers it", _answer, _answers, REQUEST_TOKENS),
    ]


def examples() -> list[bytes]:
    """The configurations that come with the gateway, without their remarks."""
    folder = files("gateway") / "examples"
    texts = [one.read_text("utf-8") for one in sorted(folder.iterdir(), key=str) if one.name.endswith(".toml")]
    return ["\n".join(line for line in text.splitlines() if line and line[0] != "#").encode() for text in texts]


def _load(data: bytes) -> None:
    with as_file(data, "rov.toml") as path:
        try:
            load(path)
        except ConfigError as error:
            require(str(path) in str(error) and "\n" in str(error), f"no file or no problem in {error}")


def _ask(data: bytes) -> None:
    """A request that is one says the same when it is written again, and names subjects or is refused in words."""
    try:
        request = Request.parse(data)
    except ValueError:
        return
    require(Request.parse(request.line()) == request, f"{request} is written as another")
    with suppress(ValueError):
        subjects_named(request.subjects, _SUBJECTS)


def _answer(data: bytes) -> None:
    try:
        answer = Answer.parse(data)
    except ValueError:
        return
    list(lines(answer))
    answer.line()


def _requests() -> list[bytes]:
    asked = [Request("status"), Request("acknowledge", ("T1", "dvl")), Request("mute", ("all",), 600.0)]
    return [one.line() for one in asked]


def _answers() -> list[bytes]:
    texts = (Said(3.0, 2, "T3 entangled? 1486 rpm, want 1619 (-8%)"), Said(300.0, 6, "ready"))
    status = Answer(True, ("watching",), {"thruster 3": "FAULT", "dvl": "NORMAL"}, texts)
    return [status.line(), Answer(False, ("no subject is called T9",)).line()]
