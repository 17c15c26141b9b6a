"""Reads a log by three readers that share no code with its writer, and compares every message with what was written.

Usage: check_log.py LOG EXPECTED

EXPECTED has a JSON object a line for each message, in the log's order: its topic, type, time, bytes (hexadecimal) and values, in which null stands for a
number that is not finite (its bits are compared with the bytes).
"""

import json
import math
import struct
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def same(found, expected, where):
    """Compares a decoded value with one of JSON, field by field."""
    if isinstance(expected, dict):
        names = [name.lstrip("_") for name in getattr(found, "__slots__", None) or vars(found)]
        fields = [name for name in names if not name.startswith("msgtype") and not name.isupper()]
        assert set(expected) <= set(fields), f"{where}: {fields}"
        for name, value in expected.items():
            same(getattr(found, name), value, f"{where}.{name}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), f"{where}: {len(found)} of {len(expected)}"
        for at, value in enumerate(expected):
            same(found[at], value, f"{where}[{at}]")
    elif expected is None:
        assert not math.isfinite(found), f"{where}: {found}"
    elif isinstance(expected, float):
        # A float32 is the nearest to what its decimal digits say.
        single = struct.unpack("f", struct.pack("f", expected))[0] if abs(expected) < 3.4e38 else None
        assert found == expected or found == single, f"{where}: {found} is not {expected}"
    elif isinstance(expected, int) and 127 < expected < 256 and found == expected - 256:
        pass  # rosbags reads a `byte` with a sign.
    elif isinstance(found, bytes):
        assert found == bytes([expected]), f"{where}: {found}"
    else:
        assert found == expected, f"{where}: {found!r} is not {expected!r}"


def main(log, expected_lines):
    expected = [json.loads(line) for line in Path(expected_lines).read_text(encoding="utf-8").splitlines()]
    store = get_typestore(Stores.ROS2_HUMBLE)
    # What the log says of its messages must be what ROS itself has.
    seen = set()
    with Path(log).open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        count = 0
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            wanted = expected[count]
            where = f"message {count}, {schema.name}"
            assert (channel.topic, schema.name, message.log_time) == (wanted["topic"], wanted["name"], wanted["time"]), where
            assert message.data == bytes.fromhex(wanted["cdr"]), where
            same(decoded, wanted["values"], where)
            # By rosbags' own definitions: the same values, and the same bytes when they are written again.
            theirs = store.deserialize_cdr(message.data, schema.name)
            same(theirs, wanted["values"], where)
            again = bytes(store.serialize_cdr(theirs, schema.name))
            assert again == message.data, f"{where}: {again.hex()} is not {message.data.hex()}"
            if schema.name not in seen:
                ours = get_types_from_msg(schema.data.decode(), schema.name)
                for name, (_, fields) in ours.items():
                    assert fields == store.fielddefs[name][1], f"{name}: {fields} is not {store.fielddefs[name][1]}"
                seen.add(schema.name)
            count += 1
    assert count == len(expected), f"{count} of {len(expected)}"
    print(f"{count} messages of {len(seen)} types")


main(*sys.argv[1:])
