"""Compares what readers in Python make of a message."""

import math
import struct


def fields(found):
    """The names of a decoded message's fields."""
    return [name for name in getattr(found, "__slots__", None) or vars(found) if not name.startswith("__")]


def same(found, expected, where):
    """Compares a decoded value with one of JSON, in which null stands for a number that is not finite."""
    if isinstance(expected, dict):
        assert set(expected) == set(fields(found)), f"{where}: {fields(found)}"
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
        nearest = struct.unpack("f", struct.pack("f", expected))[0] if abs(expected) < 3.4e38 else expected
        assert found in (expected, nearest), f"{where}: {found} is not {expected}"
        assert math.copysign(1, found) == math.copysign(1, expected), f"{where}: {found} is not {expected}"
    else:
        assert found == expected, f"{where}: {found!r} is not {expected!r}"


def alike(one, other, where):
    """Compares two decoded values: numbers bit by bit, so that this holds for those that JSON has no word for."""
    if hasattr(other, "__dataclass_fields__"):
        # The other one has its constants among them, which are no fields.
        for name in fields(one):
            alike(getattr(one, name), getattr(other, name), f"{where}.{name}")
    elif isinstance(other, str):
        assert one == other, f"{where}: {one!r} is not {other!r}"
    elif hasattr(other, "__len__"):
        assert len(one) == len(other), f"{where}: {len(one)} is not {len(other)}"
        for at, value in enumerate(other):
            alike(one[at], value, f"{where}[{at}]")
    elif isinstance(one, int):
        # Of a `byte` one has 0 to 255, the other -128 to 127.
        assert one == other or (one - other) in (-256, 256), f"{where}: {one} is not {other}"
    else:
        assert struct.pack("d", one) == struct.pack("d", other), f"{where}: {one} is not {other}"
