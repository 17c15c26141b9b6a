"""Recovers what a process that was killed has left of its log, as `mcap recover` does: each message that is whole goes into a log with an index.

Usage: check_cut.py LOG RECOVERED

Prints how many messages `rosbags` then reads.
"""

import sys
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap.writer import Writer
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.errors import ReaderError


def recover(log, output):
    """Reads to where the log breaks off."""
    writer = Writer(output)
    writer.start(profile="ros2")
    channels = {}
    try:
        for schema, channel, message in NonSeekingReader(log).iter_messages(log_time_order=False):
            if channel.id not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, kind, channel.metadata)
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
    except McapError:
        pass
    writer.finish()


def main(log, recovered):
    # That it does need recovering is what the documentation says.
    try:
        with Reader(log):
            raise SystemExit("the log has an end")
    except ReaderError:
        pass
    with Path(log).open("rb") as file, Path(recovered).open("wb") as output:
        recover(file, output)
    with Reader(recovered) as bag:
        print(sum(1 for _ in bag.messages()))


main(*sys.argv[1:])
