"""The channels and schemas of one file."""

from __future__ import annotations

from collections.abc import Iterable

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding

from gateway.recording.layout import Layout
from gateway.recording.record_bytes import bytes_of


class ChannelTable:
    """Gives each topic its channel, and each layout its schema.

    Attributes:
        channels, schemas: so far, by their ids.
    """

    def __init__(self) -> None:
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self._channel_ids: dict[tuple[str, str], int] = {}
        self._schema_ids: dict[tuple[str, str], int] = {}
        self._written: set[int] = set()

    def channel(self, topic: str, layout: Layout) -> int:
        """Id of the channel of this topic and layout."""
        key = topic, layout.name
        if key not in self._channel_ids:
            number = self._channel_ids[key] = len(self.channels) + 1
            self.channels[number] = Channel(number, topic, MessageEncoding.CDR, {}, self._schema(layout))
        return self._channel_ids[key]

    def records(self, channels: Iterable[int], *, again: bool) -> bytes:
        """Records of these channels, in front of their messages, and of their schemas where they are not in the file.

        A chunk thus needs no other one to be replayed.

        Args:
            channels: ids.
            again: schemas that are in the file, too: viewers need them.
        """
        builder = RecordBuilder()
        wanted = [self.channels[one] for one in sorted(set(channels))]
        schemas = {one.schema_id for one in wanted}
        for schema in sorted(schemas if again else schemas - self._written):
            self.schemas[schema].write(builder)
        for one in wanted:
            one.write(builder)
        self._written |= schemas
        return bytes_of(builder)

    def _schema(self, layout: Layout) -> int:
        key = layout.name, layout.text
        if key not in self._schema_ids:
            number = self._schema_ids[key] = len(self.schemas) + 1
            self.schemas[number] = Schema(number, layout.text.encode(), SchemaEncoding.ROS2, layout.name)
        return self._schema_ids[key]
