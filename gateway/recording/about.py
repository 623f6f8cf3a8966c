"""What a recording says of itself, as metadata and attachments of its files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from mcap.records import Attachment, Metadata

from gateway.recording.entries import About
from gateway.recording.times import nanosecond

PROGRAM = "thruster-gateway"
FORMAT = "1"
_CONFIG, _STATE, _FILES = "config.toml", "state", "files/"
_YES, _NO = "yes", "no"


class AboutError(Exception):
    """What a file says of itself is not all there, or of another format."""


def library(about: About) -> str:
    """For the header of a file: by whom it was written."""
    return f"{PROGRAM} {about.version}"


def metadata(about: About, place: int) -> Metadata:
    """Its short values, with the place of what was recorded last before this file."""
    values = {
        "format": FORMAT,
        "run": about.run,
        "part": str(about.part),
        "started_s": repr(about.started_s),
        "vehicle": about.vehicle,
        "version": about.version,
        "resumed": _YES if about.resumed else _NO,
        "place": str(place),
    }
    return Metadata(PROGRAM, values)


def attachments(about: About) -> Iterator[Attachment]:
    """Its files. There is a configuration always, and a state where there is one."""
    yield _attachment(_CONFIG, "application/toml", about.config.encode(), about)
    for name, data in about.files.items():
        yield _attachment(_FILES + name, "application/octet-stream", data, about)
    if about.state:
        yield _attachment(_STATE, "application/octet-stream", about.state, about)


def read_about_from(values: Mapping[str, str], files: Iterable[Attachment], path: Path) -> tuple[About, int]:
    """The same again, with the place.

    Raises:
        AboutError: something is missing, or not as it should be.
    """
    if values.get("format") != FORMAT:
        raise AboutError(f"what it says of itself is of format {values.get('format', 'unknown')}: want {FORMAT}")
    data = {one.name: one.data for one in files}
    try:
        about = About(
            run=values["run"],
            part=int(values["part"]),
            started_s=float(values["started_s"]),
            vehicle=values["vehicle"],
            version=values["version"],
            config=data[_CONFIG].decode(),
            files={name.removeprefix(_FILES): one for name, one in data.items() if name.startswith(_FILES)},
            state=data.get(_STATE, b""),
            resumed=values["resumed"] == _YES,
            path=path,
        )
        return about, int(values["place"])
    except (KeyError, ValueError) as error:
        raise AboutError(f"what it says of itself is damaged ({error})") from error


def _attachment(name: str, media_type: str, data: bytes, about: About) -> Attachment:
    time_ns = nanosecond(about.started_s)
    return Attachment(time_ns, time_ns, name, media_type, data)
