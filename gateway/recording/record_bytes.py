"""What a `RecordBuilder` of the mcap package has built."""

from __future__ import annotations

from mcap.data_stream import RecordBuilder


def bytes_of(builder: RecordBuilder) -> bytes:
    """All that was written to it; it is empty then."""
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
