"""Messages of one channel, laid out as the records of an MCAP file: many at once where their size is fixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gateway.recording.layout import ENCAPSULATION, Layout
from gateway.recording.times import nanoseconds

MESSAGE = 0x05  # the opcode of a message record
# opcode, length of what follows, channel, sequence, log time, publish time
HEAD = Struct("<BQHIQQ")
_COUNTED = HEAD.size - 9  # of these bytes, by the length in them
_SEQUENCES = 1 << 32


@dataclass(frozen=True, slots=True)
class MessageBlock:
    """N messages of one channel.

    Attributes:
        channel: its id in the file.
        data: their records, one behind the other.
        log_time: (N,) nanoseconds.
        offset: (N,) where each begins in `data`.
    """

    channel: int
    data: bytes
    log_time: NDArray[np.int64]
    offset: NDArray[np.int64]


@lru_cache(maxsize=256)
def record_row(layout: Layout) -> np.dtype[np.void]:
    """A record of a message of fixed size: its head, and the fields of the message."""
    inner = layout.row
    assert inner.names is not None and inner.fields is not None  # noqa: S101  it has fields, by its making
    heads = {"opcode": ("u1", 0), "size": ("<u8", 1), "channel": ("<u2", 9), "sequence": ("<u4", 11)}
    heads |= {"log_time": ("<u8", 15), "publish_time": ("<u8", 23)}
    inside = {f"message.{name}": (inner.fields[name][0], HEAD.size + inner.fields[name][1]) for name in inner.names}
    named: dict[str, tuple[Any, int]] = {**heads, **inside}
    return np.dtype(
        {
            "names": list(named),
            "formats": [kind for kind, _ in named.values()],
            "offsets": [offset for _, offset in named.values()],
            "itemsize": HEAD.size + inner.itemsize,
        }
    )


def row_block(
    channel: int, layout: Layout, time_ns: NDArray[np.int64], sequence: Any, columns: Mapping[str, Any]
) -> MessageBlock:
    """Messages of fixed size.

    Args:
        channel: its id in the file.
        layout: of fixed size.
        time_ns: (N,) log times.
        sequence: (N,) or one for all; modulo 2^32.
        columns: by field, (N,) or (N, count), or one for all.
    """
    kind = record_row(layout)
    rows = np.zeros(len(time_ns), dtype=kind)
    rows["opcode"], rows["size"], rows["channel"] = MESSAGE, kind.itemsize - 9, channel
    rows["sequence"] = np.asarray(sequence) % _SEQUENCES
    rows["log_time"] = rows["publish_time"] = time_ns
    rows["message.encapsulation"] = np.void(ENCAPSULATION)
    for name, column in columns.items():
        rows[f"message.{name}"] = column
    return MessageBlock(channel, rows.tobytes(), time_ns, np.arange(len(rows)) * kind.itemsize)


def message_block(channel: int, messages: Sequence[tuple[int, float, bytes]]) -> MessageBlock:
    """Messages of any size: of each, sequence, time in seconds, and bytes."""
    times = nanoseconds([time_s for _, time_s, _ in messages])
    records = [
        HEAD.pack(MESSAGE, _COUNTED + len(data), channel, sequence % _SEQUENCES, time_ns, time_ns) + data
        for (sequence, _, data), time_ns in zip(messages, times.tolist(), strict=True)
    ]
    offsets = list(accumulate((len(one) for one in records[:-1]), initial=0))
    return MessageBlock(channel, b"".join(records), times, np.array(offsets))
