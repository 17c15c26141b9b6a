"""A node on the network that shares no code with the bridge: Cyclone DDS, with the types of ROS 2 written down once more.

Usage: peer.py NAMESPACE, then a command a line on standard input; each answers with a JSON object a line.

    wait SECONDS                        waits until the bridge's odometry is heard
    odom COUNT                          the next odometry
    tf | tf_static | battery | joints | diagnostics
    nodes READERS WRITERS               what ros_discovery_info says of the node, once it has so many; its topics by name and type
    drive V W SECONDS [KIND]            speeds, 20 times a second; KIND is best_effort, reliable or stamped. How many readers match, and where the base is then
    begin V W | end                     the same until it ends, with other commands in between
    fix X Y YAW | goal X Y YAW | initial X Y YAW
    trigger NAME | enable 0/1 | set_pose X Y YAW    calls a service, as ROS 2 does on Cyclone DDS
    gaps SECONDS                        odometry for so long: how many, the longest time between two: as they arrived, were written, were measured
    steps COUNT                         speeds that change so often, and when each was said first
    gone SECONDS                        waits until nobody publishes odometry any more
"""

import json
import math
import os
import random
import sys
import threading
import time
from dataclasses import dataclass

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, int64, sequence, uint8, uint32, uint64
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
class PoseStamped(IdlStruct, typename=ros("geometry_msgs", "PoseStamped")):
    header: Header
    pose: Pose


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
    data: array[uint8, int(os.environ.get("GID_BYTES", "16"))]


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


def srv(package, name):
    return f"{package}::srv::dds_::{name}_"


# Of the client that asks, and how many questions it has asked: ROS 2 on Cyclone DDS has them in front of each question and each answer.
@dataclass
class TriggerRequest(IdlStruct, typename=srv("std_srvs", "Trigger_Request")):
    client: uint64
    number: int64
    structure_needs_at_least_one_member: uint8


@dataclass
class TriggerResponse(IdlStruct, typename=srv("std_srvs", "Trigger_Response")):
    client: uint64
    number: int64
    success: bool
    message: str


@dataclass
class SetBoolRequest(IdlStruct, typename=srv("std_srvs", "SetBool_Request")):
    client: uint64
    number: int64
    data: bool


@dataclass
class SetBoolResponse(IdlStruct, typename=srv("std_srvs", "SetBool_Response")):
    client: uint64
    number: int64
    success: bool
    message: str


@dataclass
class SetPoseRequest(IdlStruct, typename=srv("robot_localization", "SetPose_Request")):
    client: uint64
    number: int64
    pose: PoseWithCovarianceStamped


@dataclass
class SetPoseResponse(IdlStruct, typename=srv("robot_localization", "SetPose_Response")):
    client: uint64
    number: int64
    structure_needs_at_least_one_member: uint8


BLOCKING = Policy.Reliability.Reliable(duration(milliseconds=100))
RELIABLE = Qos(BLOCKING, Policy.History.KeepLast(10))
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(1))
KEPT = Qos(BLOCKING, Policy.Durability.TransientLocal, Policy.History.KeepLast(10))
SPEED_PERIOD = 0.05
PATIENCE = 10.0


def plain(value):
    """A message as JSON has it; what is no number is null."""
    if isinstance(value, IdlStruct):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def header(frame):
    now = time.time_ns()
    return Header(Time(now // 10**9, now % 10**9), frame)


def pose(x, y, yaw):
    half = float(yaw) / 2
    return Pose(Point(float(x), float(y), 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


def uncertain(x, y, yaw):
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = covariance[35] = 1e-4
    return PoseWithCovarianceStamped(header("map"), PoseWithCovariance(pose(x, y, yaw), covariance))


def twist(v, w):
    return Twist(Vector3(float(v), 0.0, 0.0), Vector3(0.0, 0.0, float(w)))


def stamped(v, w):
    return TwistStamped(header("base_link"), twist(v, w))


KINDS = {
    "best_effort": (Twist, BEST_EFFORT, twist),
    "reliable": (Twist, RELIABLE, twist),
    "stamped": (TwistStamped, BEST_EFFORT, stamped),
}


class Driver:
    """Says speeds until it is told to end."""

    def __init__(self, writer, make, v, w):
        self.going = True
        self.thread = threading.Thread(target=self.drive, args=(writer, make, v, w), daemon=True)
        self.thread.start()

    def drive(self, writer, make, v, w):
        while self.going:
            writer.write(make(v, w))
            time.sleep(SPEED_PERIOD)

    def end(self):
        self.going = False
        self.thread.join()


class Peer:
    def __init__(self, namespace):
        self.namespace = namespace.strip("/")
        self.participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        self.odom_reader = self.reader("odom", Odometry, RELIABLE)
        self.writers = {}
        self.driver = None
        self.asked = 0

    def name(self, name):
        if name.startswith("/"):
            return name
        return f"/{self.namespace}/{name}" if self.namespace else f"/{name}"

    def topic(self, name, kind, prefix="rt"):
        return Topic(self.participant, prefix + self.name(name), kind)

    def reader(self, name, kind, qos, prefix="rt"):
        return DataReader(self.participant, self.topic(name, kind, prefix), qos=qos)

    def writer(self, name, kind, qos, prefix="rt"):
        key = (name, kind, qos is RELIABLE)
        if key not in self.writers:
            self.writers[key] = DataWriter(self.participant, self.topic(name, kind, prefix), qos=qos)
        return self.writers[key]

    def until(self, seconds, found):
        until = time.monotonic() + float(seconds)
        while True:
            answer = found()
            if answer or time.monotonic() > until:
                return answer
            time.sleep(0.001)

    def matched(self, writer, seconds=PATIENCE):
        return len(self.until(seconds, writer.get_matched_subscriptions))

    def take(self, reader, seconds=PATIENCE):
        samples = self.until(seconds, lambda: reader.take(N=1))
        if not samples:
            raise TimeoutError("nothing was heard")
        return samples[0]

    def newest(self):
        self.odom_reader.take(N=1000)
        return plain(self.take(self.odom_reader))

    def wait(self, seconds):
        self.odom_reader.take(N=1000)
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

    def nodes(self, readers, writers):
        infos = DataReader(
            self.participant, Topic(self.participant, "ros_discovery_info", ParticipantEntitiesInfo), qos=KEPT
        )
        last = {}

        def found():
            for info in infos.take(N=100):
                for node in info.node_entities_info_seq:
                    last[node.node_namespace.strip("/")] = node
            node = last.get(self.namespace)
            return node if node and len(node.reader_gid_seq) == int(readers) and len(node.writer_gid_seq) == int(writers) else None

        node = self.until(PATIENCE, found) or last[self.namespace]
        return {
            "name": node.node_name,
            "namespace": node.node_namespace,
            "readers": self.endpoints(BuiltinTopicDcpsSubscription, node.reader_gid_seq),
            "writers": self.endpoints(BuiltinTopicDcpsPublication, node.writer_gid_seq),
        }

    def endpoints(self, kind, gids):
        """Topic and type of what DDS itself has found under these numbers."""
        wanted = {bytes(gid.data)[:16] for gid in gids}
        found = {}
        reader = BuiltinDataReader(self.participant, kind)

        def all_there():
            for each in reader.read(N=1000):
                if each.key.bytes in wanted:
                    found[each.key.bytes] = f"{each.topic_name} {each.type_name}"
            return len(found) == len(wanted)

        self.until(PATIENCE, all_there)
        return sorted(found.get(each, "?") for each in wanted)

    def begin(self, v, w, kind="best_effort"):
        message, qos, make = KINDS[kind]
        writer = self.writer("cmd_vel", message, qos)
        # Who never matches is not waited for long.
        matched = self.matched(writer, 3)
        self.driver = Driver(writer, make, v, w)
        return {"matched": matched}

    def end(self):
        self.driver.end()
        self.driver = None
        return {}

    def drive(self, v, w, seconds, kind="best_effort"):
        answer = self.begin(v, w, kind)
        time.sleep(float(seconds))
        answer["odom"] = self.newest()
        self.end()
        return answer

    def late(self, v, w, seconds):
        """Says for a second to stand still; then speeds that come so much later than they are said, as from a network that was away."""
        writer = self.writer("cmd_vel", Twist, BEST_EFFORT)
        matched = self.matched(writer)
        until = time.monotonic() + 1
        while time.monotonic() < until:
            writer.write(twist(0, 0))
            time.sleep(SPEED_PERIOD)
        said = time.time_ns()
        time.sleep(float(seconds))
        for each in range(5):
            writer.write(twist(v, w), timestamp=said + int(each * SPEED_PERIOD * 1e9))
        return {"matched": matched}

    def say(self, name, message):
        writer = self.writer(name, type(message), BEST_EFFORT)
        matched = self.matched(writer)
        # The reader may be about to find the writer, and nobody says a best-effort sample twice.
        time.sleep(0.2)
        writer.write(message)
        return {"matched": matched}

    def fix(self, *at):
        return self.say("pose_fix", uncertain(*at))

    def initial(self, *at):
        return self.say("initialpose", uncertain(*at))

    def goal(self, *at):
        return self.say("goal_pose", PoseStamped(header("map"), pose(*at)))

    def call(self, name, request, response, *content):
        asks = self.writer(name + "Request", request, RELIABLE, "rq")
        hears = self.reader(name + "Reply", response, RELIABLE, "rr")
        if not self.matched(asks) or not self.until(PATIENCE, hears.get_matched_publications):
            raise TimeoutError("no service")
        self.asked += 1
        client = asks.guid.int & (2**64 - 1)
        client = int.from_bytes(client.to_bytes(8, "big"), "little")
        asks.write(request(client, self.asked, *content))

        def mine():
            for answer in hears.take(N=10):
                if (answer.client, answer.number) == (client, self.asked):
                    return answer
            return None

        answer = self.until(PATIENCE, mine)
        if answer is None:
            raise TimeoutError("no answer")
        return plain(answer)

    def trigger(self, name):
        return self.call(name, TriggerRequest, TriggerResponse, 0)

    def enable(self, on):
        return self.call("enable", SetBoolRequest, SetBoolResponse, on == "1")

    def set_pose(self, *at):
        return self.call("set_pose", SetPoseRequest, SetPoseResponse, uncertain(*at))

    def gaps(self, seconds):
        """By the host's clock where they arrive, where they were written, and by the stamps of their measurement: which of the three is late tells who was."""
        self.take(self.odom_reader)
        count, longest, lasts = 0, [0.0, 0.0, 0.0], None
        until = time.monotonic() + float(seconds)
        while time.monotonic() < until:
            for odom in self.odom_reader.take(N=100):
                stamp = odom.header.stamp.sec + odom.header.stamp.nanosec * 1e-9
                now = [time.monotonic(), odom.sample_info.source_timestamp * 1e-9, stamp]
                if lasts:
                    longest = [max(most, at - last) for most, at, last in zip(longest, now, lasts)]
                lasts = now
                count += 1
            time.sleep(0.001)
        return {"count": count, "arrival": longest[0], "written": longest[1], "stamp": longest[2]}

    def steps(self, count):
        """Turning all the while, so that the translation alone changes, and is steady again before the next one: 0.1 m/s at 0.5 m/s² take 0.2 s."""
        writer = self.writer("cmd_vel", Twist, BEST_EFFORT)
        self.matched(writer)
        chance = random.Random(3)
        for _ in range(40):
            writer.write(twist(0.2, 0.5))
            time.sleep(SPEED_PERIOD)
        said = []
        for step in range(int(count)):
            speeds = twist(0.1 if step % 2 == 0 else 0.2, 0.5)
            said.append(time.time())
            writer.write(speeds)
            time.sleep(0.12)
            writer.write(speeds)
            time.sleep(0.13 + chance.uniform(0.0, 0.02))
        return {"said": said}

    def gone(self, seconds):
        began = time.monotonic()
        self.until(seconds, lambda: not self.odom_reader.get_matched_publications())
        return {"left": not self.odom_reader.get_matched_publications(), "after": time.monotonic() - began}


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


if __name__ == "__main__":
    main(*sys.argv[1:])
