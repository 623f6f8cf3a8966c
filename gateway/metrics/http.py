"""The little of HTTP that a scrape needs: the head of a request in, what to answer out."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from http.client import HTTPException, parse_headers
from urllib.parse import urlsplit

from gateway.metrics.address import PATH
from gateway.metrics.exposition import CONTENT_TYPE

# A page of the web can make a browser on this machine ask us, under a name of its own that leads to the loopback
# (DNS rebinding); then `Host` is that name
HOSTS = frozenset({"127.0.0.1", "localhost", "::1"})
PLAIN = "text/plain; charset=utf-8"


@dataclass(frozen=True, slots=True)
class Reply:
    """What is answered. `cause`: why a request was refused; empty where it was served."""

    status: HTTPStatus
    body: bytes
    content_type: str = PLAIN
    cause: str = ""

    def encoded(self) -> bytes:
        """For the wire; the connection ends after it."""
        head = (
            f"HTTP/1.1 {self.status.value} {self.status.phrase}",
            f"Content-Type: {self.content_type}",
            f"Content-Length: {len(self.body)}",
            *(("Allow: GET",) if self.status is HTTPStatus.METHOD_NOT_ALLOWED else ()),
            "Connection: close",
        )
        return "".join(f"{line}\r\n" for line in (*head, "")).encode() + self.body


def reply(head: bytes, text: Callable[[], bytes]) -> Reply:
    """What is answered to a request.

    Args:
        head: its first line and headers, with the empty line behind them.
        text: gives what is served.
    """
    line, _, rest = head.partition(b"\r\n")
    try:
        method, target, version = line.decode("ascii").split(" ")
        hosts = parse_headers(io.BytesIO(rest)).get_all("Host", [])
        path = urlsplit(target).path
    except (ValueError, HTTPException):
        return _refused(HTTPStatus.BAD_REQUEST, "no request of HTTP")
    if not version.startswith("HTTP/1."):
        return _refused(HTTPStatus.HTTP_VERSION_NOT_SUPPORTED, "another version of HTTP")
    if len(hosts) != 1 or not _is_ours(hosts[0]):
        return _refused(HTTPStatus.FORBIDDEN, "asked by another name than localhost or 127.0.0.1")
    if path != PATH:
        return _refused(HTTPStatus.NOT_FOUND, f"not {PATH}")
    if method != "GET":
        return _refused(HTTPStatus.METHOD_NOT_ALLOWED, "not GET")
    return Reply(HTTPStatus.OK, text(), CONTENT_TYPE)


def _is_ours(host: str) -> bool:
    try:
        return urlsplit(f"//{host.strip()}").hostname in HOSTS
    except ValueError:
        return False


def _refused(status: HTTPStatus, cause: str) -> Reply:
    return Reply(status, f"{cause}\n".encode(), cause=cause)
