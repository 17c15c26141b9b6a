"""Ten simulated bases on this computer's ROS 2 network, r1 to r10, each in a namespace of its own. For those who start everything by `ros2 launch`:

    cargo build --release -p base-bridge --features dds
    ros2 launch base-bridge/examples/ten_bases.launch.py

BASES: how many; BRIDGE: the program, if it is elsewhere.
"""

from os import environ
from pathlib import Path

from launch import LaunchDescription
from launch.actions import ExecuteProcess

HERE = Path(__file__).resolve().parent
BRIDGE = environ.get("BRIDGE", str(HERE.parents[1] / "target/release/base-bridge"))


def base(n):
    # A program that is no part of ROS: its options are its own, not those behind --ros-args. A real base has --port instead of --sim and --seed.
    return ExecuteProcess(
        cmd=[
            BRIDGE,
            *("--sim", "--seed", str(n)),
            *("--namespace", f"r{n}"),
            *("--params-file", str(HERE / "fleet.yaml")),
            *("-p", f"frames.prefix:=r{n}/"),
        ],
        name=f"r{n}",
        output="screen",
    )


def generate_launch_description():
    return LaunchDescription([base(n) for n in range(1, int(environ.get("BASES", "10")) + 1)])
