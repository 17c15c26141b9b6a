"""A node on the network that shares no code with the bridge: Cyclone DDS, with the types of ROS 2 written down once more.

Usage: peer.py NAMESPACE, then a command a line on standard input; each answers with a JSON object a line.

    wait SECONDS                    waits until the bridge's odometry is heard
    odom COUNT                      the next odometry
    tf | tf_static | battery | joints | diagnostics
    drive V W SECONDS [reliable]    speeds, 20 times a second, and where the base was before and after
    wrong SECONDS                   numbers as another type on the name of the speeds; how many readers match
    nan SECONDS                     speeds that are no numbers
    fix X Y YAW                     a pose from outside, of now
    nodes                           what ros_discovery_info says
"""

import json
import math
import os
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


def ros(package, name):
    return f"{package}::msg::dds_::{name}_"


@dataclass
class Time(IdlStruct, typename=ros("builtin_interfaces", "Time")):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename=ros("std_msgs", "Header")):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename=ros("geometry_msgs", "Vector3")):
    x: float64
    y: float64
    z: float64


@dataclass
class Point(IdlStruct, typename=ros("geometry_msgs", "Point")):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename=ros("geometry_msgs", "Quaternion")):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename=ros("geometry_msgs", "Pose")):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename=ros("geometry_msgs", "PoseWithCovariance")):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseWithCovarianceStamped(IdlStruct, typename=ros("geometry_msgs", "PoseWithCovarianceStamped")):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Twist(IdlStruct, typename=ros("geometry_msgs", "Twist")):
    linear: Vector3
    angular: Vector3


@dataclass
class TwistStamped(IdlStruct, typename=ros("geometry_msgs", "TwistStamped")):
    header: Header
    twist: Twist


@dataclass
class TwistWithCovariance(IdlStruct, typename=ros("geometry_msgs", "TwistWithCovariance")):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename=ros("nav_msgs", "Odometry")):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class Transform(IdlStruct, typename=ros("geometry_msgs", "Transform")):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename=ros("geometry_msgs", "TransformStamped")):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename=ros("tf2_msgs", "TFMessage")):
    transforms: sequence[TransformStamped]


@dataclass
class BatteryState(IdlStruct, typename=ros("sensor_msgs", "BatteryState")):
    header: Header
    voltage: float32
    temperature: float32
    current: float32
    charge: float32
    capacity: float32
    design_capacity: float32
    percentage: float32
    power_supply_status: uint8
    power_supply_health: uint8
    power_supply_technology: uint8
    present: bool
    cell_voltage: sequence[float32]
    cell_temperature: sequence[float32]
    location: str
    serial_number: str


@dataclass
class JointState(IdlStruct, typename=ros("sensor_msgs", "JointState")):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class KeyValue(IdlStruct, typename=ros("diagnostic_msgs", "KeyValue")):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename=ros("diagnostic_msgs", "DiagnosticStatus")):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename=ros("diagnostic_msgs", "DiagnosticArray")):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Gid(IdlStruct, typename=ros("rmw_dds_common", "Gid")):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename=ros("rmw_dds_common", "NodeEntitiesInfo")):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename=ros("rmw_dds_common", "ParticipantEntitiesInfo")):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


RELIABLE = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(100))
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(100))
KEPT = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.Durability.TransientLocal,
    Policy.History.KeepLast(10),
)
SPEED_PERIOD = 0.05


def plain(value):
    """A message as JSON has it; what is no number is null."""
    if isinstance(value, IdlStruct):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


class Peer:
    def __init__(self, namespace):
        self.namespace = namespace
        self.participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        self.odom_reader = self.reader("odom", Odometry, RELIABLE)
        self.writers = {}

    def name(self, name):
        whole = name if name.startswith("/") else f"{self.namespace.rstrip('/')}/{name}"
        return f"rt{whole}"

    def reader(self, name, kind, qos):
        return DataReader(self.participant, Topic(self.participant, self.name(name), kind), qos=qos)

    def writer(self, name, kind, qos, key):
        if key not in self.writers:
            self.writers[key] = DataWriter(self.participant, Topic(self.participant, self.name(name), kind), qos=qos)
        return self.writers[key]

    def matched(self, writer, seconds):
        until = time.monotonic() + seconds
        while time.monotonic() < until and not writer.get_matched_subscriptions():
            time.sleep(0.01)
        return len(writer.get_matched_subscriptions())

    def take(self, reader, seconds=10.0):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            samples = reader.take(N=1)
            if samples:
                return samples[0]
            time.sleep(0.001)
        raise TimeoutError("nothing was heard")

    def newest(self):
        for _ in self.odom_reader.take(N=1000):
            pass
        return self.take(self.odom_reader)

    def wait(self, seconds):
        began = time.monotonic()
        self.take(self.odom_reader, float(seconds))
        return {"after": time.monotonic() - began}

    def odom(self, count):
        self.odom_reader.take(N=1000)
        return {"odom": [plain(self.take(self.odom_reader)) for _ in range(int(count))]}

    def once(self, name, kind, qos=RELIABLE):
        return plain(self.take(self.reader(name, kind, qos)))

    def tf(self):
        return self.once("/tf", TFMessage)

    def tf_static(self):
        return self.once("/tf_static", TFMessage, KEPT)

    def battery(self):
        return self.once("battery_state", BatteryState)

    def joints(self):
        return self.once("joint_states", JointState)

    def diagnostics(self):
        return self.once("/diagnostics", DiagnosticArray)

    def nodes(self):
        reader = DataReader(
            self.participant,
            Topic(self.participant, "ros_discovery_info", ParticipantEntitiesInfo),
            qos=KEPT,
        )
        until = time.monotonic() + 10
        while time.monotonic() < until:
            for info in reader.take(N=10):
                for node in info.node_entities_info_seq:
                    if node.node_namespace.strip("/") == self.namespace.strip("/"):
                        return {
                            "name": node.node_name,
                            "namespace": node.node_namespace,
                            "readers": len(node.reader_gid_seq),
                            "writers": len(node.writer_gid_seq),
                        }
            time.sleep(0.01)
        raise TimeoutError("no node was heard of")

    def send(self, writer, v, w, seconds):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            writer.write(Twist(Vector3(v, 0.0, 0.0), Vector3(0.0, 0.0, w)))
            time.sleep(SPEED_PERIOD)

    def drive(self, v, w, seconds, reliability="best_effort"):
        qos = RELIABLE if reliability == "reliable" else BEST_EFFORT
        writer = self.writer("cmd_vel", Twist, qos, f"twist {reliability}")
        matched = self.matched(writer, 5)
        before = plain(self.newest())
        self.send(writer, float(v), float(w), float(seconds))
        during = plain(self.newest())
        return {"matched": matched, "before": before, "during": during}

    def nan(self, seconds):
        writer = self.writer("cmd_vel", Twist, BEST_EFFORT, "twist best_effort")
        matched = self.matched(writer, 5)
        self.send(writer, math.nan, 0.0, float(seconds))
        return {"matched": matched, "during": plain(self.newest())}

    def wrong(self, seconds):
        writer = self.writer("cmd_vel", TwistStamped, BEST_EFFORT, "stamped")
        matched = self.matched(writer, 2)
        until = time.monotonic() + float(seconds)
        while time.monotonic() < until:
            zero = Vector3(0.0, 0.0, 0.0)
            writer.write(TwistStamped(Header(Time(0, 0), ""), Twist(Vector3(0.2, 0.0, 0.0), zero)))
            time.sleep(SPEED_PERIOD)
        return {"matched": matched, "during": plain(self.newest())}

    def fix(self, x, y, yaw):
        writer = self.writer("pose_fix", PoseWithCovarianceStamped, BEST_EFFORT, "fix")
        matched = self.matched(writer, 5)
        now = time.time_ns()
        covariance = [0.0] * 36
        covariance[0] = covariance[7] = 1e-4
        covariance[35] = 1e-4
        half = float(yaw) / 2
        pose = Pose(Point(float(x), float(y), 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))
        header = Header(Time(now // 10**9, now % 10**9), "map")
        writer.write(PoseWithCovarianceStamped(header, PoseWithCovariance(pose, covariance)))
        return {"matched": matched}


def main(namespace):
    peer = Peer(namespace)
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        command, *words = line.split()
        try:
            answer = getattr(peer, command)(*words)
        except TimeoutError as error:
            answer = {"error": str(error)}
        print(json.dumps(answer), flush=True)


main(*sys.argv[1:])
