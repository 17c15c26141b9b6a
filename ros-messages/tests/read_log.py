"""Reads a whole log by readers that share no code with its writer: `mcap` with `mcap-ros2-support`, by the definitions that the log carries, and `rosbags`, as a
bag and by its own definitions, which re-encodes every message to the same bytes.

Usage: read_log.py LOG. Prints how many messages each topic has, as JSON.
"""

import json
import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from values import alike


def main(log):
    store = get_typestore(Stores.ROS2_JAZZY)
    counts = Counter()
    with Path(log).open("rb") as file, Reader(log) as bag:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        bagged = bag.messages()
        for (schema, channel, message, decoded), (connection, time, data) in zip(
            reader.iter_decoded_messages(), bagged, strict=True
        ):
            where = f"{channel.topic} at {message.log_time}"
            assert (connection.topic, connection.msgtype, time) == (channel.topic, schema.name, message.log_time), where
            assert bytes(data) == message.data, where
            theirs = store.deserialize_cdr(message.data, schema.name)
            alike(decoded, theirs, where)
            assert bytes(store.serialize_cdr(theirs, schema.name)) == message.data, where
            counts[channel.topic] += 1
    print(json.dumps(counts, sort_keys=True))


main(*sys.argv[1:])
