"""Drives a fleet of bases, each around a square of its own from its own cmd_vel, all at the same time.

Usage: fleet.py BASES. Says that it is there; then, for each line on standard input, drives, and answers with a JSON object a line: for each base how many
readers its speeds have, and the corners that it says it has come to.

Base rN has the square of side 0.2 m + N · 0.04 m, counterclockwise if N is even. One more, the last, is told nothing.
"""

import json
import math
import os
import sys
import time

# Its types, and what it does with them; it starts nothing by itself.
from peer import BEST_EFFORT, RELIABLE, Odometry, Twist, twist

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

PERIOD = 0.05
# As slowly as this it goes at the end of each side and turn: m/s, rad/s.
CREEP = (0.02, 0.05)
SPEED = (0.3, 1.0)
# A side or a turn that misses less than this has come to its end: m, rad.
NEAR = (0.002, 0.005)
PATIENCE = 120.0


def towards(rest, axis):
    """The speed for what is left of a side or a turn: so much a second of it, not too fast, and not too slow to end."""
    speed = min(max(1.5 * abs(rest), CREEP[axis]), SPEED[axis])
    return math.copysign(speed, rest)


def wrapped(angle):
    return math.remainder(angle, 2 * math.pi)


class Base:
    def __init__(self, participant, number):
        self.side = 0.2 + 0.04 * number
        self.turn = math.pi / 2 if number % 2 == 0 else -math.pi / 2
        self.odom = DataReader(participant, Topic(participant, f"rt/r{number}/odom", Odometry), qos=RELIABLE)
        self.speeds = DataWriter(participant, Topic(participant, f"rt/r{number}/cmd_vel", Twist), qos=BEST_EFFORT)
        self.at = None
        self.corner = (0.0, 0.0)
        self.corners = []
        self.heading = 0.0
        self.is_turning = False

    def look(self):
        for odom in self.odom.take(N=100):
            position, turned = odom.pose.pose.position, odom.pose.pose.orientation
            self.at = (position.x, position.y, 2 * math.atan2(turned.z, turned.w))

    def is_there(self):
        self.look()
        return self.at and len(self.speeds.get_matched_subscriptions()) > 0

    def has_come_round(self):
        return len(self.corners) == 4

    def drive(self):
        self.look()
        if self.has_come_round():
            return twist(0, 0)
        aside = wrapped(self.heading - self.at[2])
        if self.is_turning:
            if abs(aside) > NEAR[1]:
                return twist(0, towards(aside, 1))
            self.is_turning = False
            return twist(0, 0)
        along = math.cos(self.heading), math.sin(self.heading)
        done = sum((at - began) * way for at, began, way in zip(self.at, self.corner, along))
        rest = self.side - done
        if abs(rest) > NEAR[0]:
            return twist(towards(rest, 0), 2 * aside)
        self.corner = self.at
        self.corners.append(self.at[:2])
        self.heading += self.turn
        self.is_turning = not self.has_come_round()
        return twist(0, 0)


def drive(bases):
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and not all(base.is_there() for base in bases):
        time.sleep(0.01)
    *driven, _ = bases
    while time.monotonic() < until and not all(base.has_come_round() for base in driven):
        for base in driven:
            base.speeds.write(base.drive())
        time.sleep(PERIOD)
    time.sleep(1.0)
    for base in bases:
        base.look()
    return [
        {"readers": len(base.speeds.get_matched_subscriptions()), "side": base.side, "corners": base.corners, "at": base.at}
        for base in bases
    ]


def main(bases):
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", "0")))
    fleet = [Base(participant, number) for number in range(1, int(bases) + 2)]
    print(json.dumps({"ready": True}), flush=True)
    for _ in sys.stdin:
        print(json.dumps({"bases": drive(fleet)}), flush=True)


main(*sys.argv[1:])
