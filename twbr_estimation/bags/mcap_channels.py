"""Schema and channel records of an MCAP file.

The classes of `mcap.records` for all kinds of records take longer to import than a recording of
a minute takes to read.
"""

from __future__ import annotations

from typing import NamedTuple

from mcap.data_stream import ReadDataStream


class SchemaRecord(NamedTuple):
    """A message type."""

    identifier: int
    name: str


class ChannelRecord(NamedTuple):
    """A topic."""

    identifier: int
    schema: int
    """Identifier of its message type."""
    topic: str
    encoding: str
    """Serialisation of its messages."""


def read_schema(stream: ReadDataStream) -> SchemaRecord:
    """Read the content of a schema record to its end.

    Raises:
        McapError: it ends early.
        struct.error: a number is cut off.
        UnicodeDecodeError: a text is no UTF-8.
    """
    schema = SchemaRecord(stream.read2(), stream.read_prefixed_string())
    stream.read_prefixed_string()  # encoding of the definition
    stream.read(stream.read4())  # the definition
    return schema


def read_channel(stream: ReadDataStream) -> ChannelRecord:
    """Read the content of a channel record to its end; errors as `read_schema`."""
    identifier, schema = stream.read2(), stream.read2()
    channel = ChannelRecord(
        identifier, schema, stream.read_prefixed_string(), stream.read_prefixed_string()
    )
    end = stream.read4() + stream.count
    while stream.count < end:  # names and values of what a recorder adds
        stream.read_prefixed_string()
        stream.read_prefixed_string()
    return channel
