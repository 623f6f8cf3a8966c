"""What is answered to a scrape, and to what is none."""

from http import HTTPStatus

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.metrics.http import reply


def head(line: str = "GET /metrics HTTP/1.1", host: str = "127.0.0.1:9464", *more: str) -> bytes:
    return "".join(f"{one}\r\n" for one in (line, f"Host: {host}", *more, "")).encode()


def answered(request: bytes) -> tuple[HTTPStatus, str]:
    answer = reply(request, lambda: b"level 1\n")
    assert (answer.status is HTTPStatus.OK) == (not answer.cause)
    return answer.status, answer.cause


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:9464", "localhost:9464", "LOCALHOST", "[::1]:9464"])
@pytest.mark.parametrize("target", ["/metrics", "/metrics?name[]=gateway_level", "http://127.0.0.1:9464/metrics"])
def test_a_scrape_is_answered(host, target):
    assert answered(head(f"GET {target} HTTP/1.1", host)) == (HTTPStatus.OK, "")


def test_the_answer_says_what_it_is_and_ends_the_connection():
    lines, _, body = reply(head(), lambda: b"level \xc3\xbc\n").encoded().partition(b"\r\n\r\n")
    assert body.decode() == "level ü\n"
    assert lines.decode().split("\r\n") == [
        "HTTP/1.1 200 OK",
        "Content-Type: text/plain; version=0.0.4; charset=utf-8",
        "Content-Length: 9",
        "Connection: close",
    ]


@pytest.mark.parametrize(
    ("request_head", "status"),
    [
        (head(host="evil.example"), 403),
        (head(host="evil.example:9464"), 403),
        (head(host="127.0.0.1.evil.example"), 403),
        (head(host="127.0.0.1@evil.example"), 403),
        (head(host="[::1"), 403),
        (head(host=""), 403),
        (b"GET /metrics HTTP/1.1\r\n\r\n", 403),
        (head("GET /metrics HTTP/1.1", "localhost", "Host: evil.example"), 403),
        (head("GET / HTTP/1.1"), 404),
        (head("GET /metrics/../etc HTTP/1.1"), 404),
        (head("POST /metrics HTTP/1.1"), 405),
        (head("GET /metrics HTTP/2.0"), 505),
        (head("GET /metrics"), 400),
        (head("GET //[ HTTP/1.1"), 400),
        (head("GET /metrics HTTP/1.1", "localhost", *["X: 1"] * 200), 400),
        (b"\x16\x03\x01\x02\x00\x01\r\n\r\n", 400),
        (b"\r\n\r\n", 400),
    ],
)
def test_what_is_refused_is_said_why(request_head, status):
    found, cause = answered(request_head)
    assert found == status and cause


@given(st.binary(max_size=80))
def test_whatever_comes_is_answered(data):
    for request_head in (data, head() + data, b"GET /metrics HTTP/1.1\r\n" + data):
        answer = reply(request_head, lambda: b"level 1\n").encoded()
        assert answer.startswith(b"HTTP/1.1 ") and answer.count(b"\r\n\r\n") == 1
