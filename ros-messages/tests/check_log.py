"""Reads a log by readers that share no code with its writer, and compares every message with what was written.

Usage: check_log.py LOG EXPECTED

EXPECTED has a JSON object a line for each message, in the log's order: its topic, type, time, bytes (hexadecimal) and values, in which null stands for a
number that is not finite.

`mcap` with `mcap-ros2-support` decodes by the definitions that the log carries, `rosbags` by its own; its reader of bags reads the file once more.
"""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from values import alike, same

# What rosbags does not bring, as ROS has it.
SERVICES = {
    "std_srvs/srv/Trigger_Request": "",
    "std_srvs/srv/Trigger_Response": "bool success\nstring message\n",
    "std_srvs/srv/SetBool_Request": "bool data\n",
    "std_srvs/srv/SetBool_Response": "bool success\nstring message\n",
    "robot_localization/srv/SetPose_Request": "geometry_msgs/PoseWithCovarianceStamped pose\n",
    "robot_localization/srv/SetPose_Response": "",
}


def known(name):
    """The name by which rosbags knows a type: it has all of them in `msg`."""
    return name.replace("/srv/", "/srv/msg/")


def typestore(distribution):
    """A distribution's definitions."""
    store = get_typestore(distribution)
    for name, text in SERVICES.items():
        store.register(get_types_from_msg(text, name))
    return store


def check_definitions(schema, stores):
    """Each type in the definition that the log carries has the fields that ROS has, in their order."""
    for name, (_, ours) in get_types_from_msg(schema.data.decode(), schema.name).items():
        for store in stores:
            theirs = store.fielddefs[name][1]
            assert ours == theirs, f"{name}: {ours} is not {theirs}"


def check_messages(log, expected, stores):
    """By the log's own definitions and by those of each distribution; the types there were."""
    seen = set()
    with Path(log).open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        found = list(reader.iter_decoded_messages(log_time_order=False))
        assert reader.get_summary().statistics.message_count == len(expected)
    assert len(found) == len(expected), f"{len(found)} of {len(expected)}"
    for (schema, channel, message, decoded), wanted in zip(found, expected):
        name, where = known(schema.name), f"{schema.name} at {message.log_time}"
        assert (channel.topic, schema.name) == (wanted["topic"], wanted["name"]), where
        assert (message.log_time, message.publish_time) == (wanted["time"], wanted["time"]), where
        assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr"), where
        assert message.data == bytes.fromhex(wanted["cdr"]), where
        same(decoded, wanted["values"], where)
        for store in stores:
            theirs = store.deserialize_cdr(message.data, name)
            alike(decoded, theirs, where)
            again = bytes(store.serialize_cdr(theirs, name))
            assert again == message.data, f"{where}: {again.hex()} is not {message.data.hex()}"
        if schema.name not in seen:
            check_definitions(schema, stores)
            seen.add(schema.name)
    return seen


def check_bag(log, expected):
    """As a bag: the same bytes at the same times, and what is kept for who comes later is marked as that."""
    with Reader(log) as bag:
        assert bag.message_count == len(expected)
        assert (bag.start_time, bag.end_time) == (expected[0]["time"], expected[-1]["time"] + 1)
        for (connection, time, data), wanted in zip(bag.messages(), expected, strict=True):
            assert (connection.topic, connection.msgtype, time) == (wanted["topic"], wanted["name"], wanted["time"])
            assert data == bytes.fromhex(wanted["cdr"]), f"{connection.msgtype} at {time}"
        for connection in bag.connections:
            offered = [(each.reliability, each.durability) for each in connection.ext.offered_qos_profiles]
            kept = [(QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL)] if connection.topic == "/tf_static" else []
            assert offered == kept, f"{connection.topic}: {offered}"


def main(log, lines):
    expected = [json.loads(line) for line in Path(lines).read_text(encoding="utf-8").splitlines()]
    stores = [typestore(each) for each in (Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY)]
    seen = check_messages(log, expected, stores)
    check_bag(log, expected)
    print(f"{len(expected)} messages of {len(seen)} types")


main(*sys.argv[1:])
