"""A small robot that runs ROS 2, written with another implementation of its wire (zenoh_ros2_sdk).

It has no time of its own: each line of its standard input is a step, `SECONDS STAMP V W TALKS`. It waits until the
newest command that it has heard is V and W, drives by it for SECONDS, publishes odometry, scan and battery with STAMP
if it TALKS, and answers with its pose. `reset` puts it back where it began.

    python robot.py PORT DOMAIN NAMESPACE MESSAGES TWIST_TYPE
"""

import math
import sys
import threading
import time
from pathlib import Path
from typing import Any

import zenoh_ros2_sdk as ros  # type: ignore[import-untyped]

PATIENCE = 60.0
"""The time in s to wait for a command; it is no part of what is tested, and never passes unless one is lost."""


def main(port: int, domain: int, namespace: str, messages: str, twist_type: str) -> None:
    """Serve until the input ends."""
    ros.get_registry().messages_dir = Path(messages)
    heard, lock = [(0.0, 0.0)], threading.Condition()

    def obey(message: Any) -> None:
        twist = message.twist if twist_type.endswith("Stamped") else message
        with lock:
            heard[0] = twist.linear.x, twist.angular.z
            lock.notify_all()

    common = {"domain_id": domain, "router_port": port, "namespace": namespace}
    odom = ros.ROS2Publisher(f"{namespace}/odom", "nav_msgs/msg/Odometry", **common)
    scan = ros.ROS2Publisher(f"{namespace}/scan", "sensor_msgs/msg/LaserScan", **common)
    battery = ros.ROS2Publisher(f"{namespace}/battery_state", "sensor_msgs/msg/BatteryState", **common)
    orders = ros.ROS2Subscriber(f"{namespace}/cmd_vel", twist_type, obey, **common)
    make = odom.session_mgr.store.types
    import numpy as np  # noqa: PLC0415 - as in the messages of the other implementation

    def header(stamp: float, frame: str) -> Any:
        time_of = make["builtin_interfaces/msg/Time"](sec=int(stamp), nanosec=round(stamp % 1.0 * 1e9))
        return make["std_msgs/msg/Header"](stamp=time_of, frame_id=frame)

    def vector(x: float, y: float, z: float) -> Any:
        return make["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)

    x = y = heading = 0.0
    print("ready", flush=True)
    for line in sys.stdin:
        if line.strip() == "reset":
            x = y = heading = 0.0
            print("reset", flush=True)
            continue
        seconds, stamp, v, w, talks = map(float, line.split())
        deadline = time.monotonic() + PATIENCE
        with lock:
            while heard[0] != (v, w) and time.monotonic() < deadline:
                lock.wait(0.1)
        x, y, heading = x + v * seconds * math.cos(heading), y + v * seconds * math.sin(heading), heading + w * seconds
        if talks:
            turn = make["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2))
            place = make["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
            pose = make["geometry_msgs/msg/Pose"](position=place, orientation=turn)
            twist = make["geometry_msgs/msg/Twist"](linear=vector(v, 0.0, 0.0), angular=vector(0.0, 0.0, w))
            unknown = np.zeros(36)
            scan.publish(
                header=header(stamp, "laser"), angle_min=-1.5, angle_max=1.5, angle_increment=0.5, time_increment=0.0,
                scan_time=0.1, range_min=0.1, range_max=8.0, intensities=np.zeros(0, np.float32),
                ranges=np.array([1.0, np.inf, 2.0, np.nan, 9.0, 0.05, -np.inf], np.float32),
            )  # fmt: skip
            battery.publish(
                header=header(stamp, ""), voltage=12.0, temperature=math.nan, current=math.nan, charge=math.nan,
                capacity=math.nan, design_capacity=math.nan, percentage=0.75, power_supply_status=0,
                power_supply_health=0, power_supply_technology=0, present=True, cell_voltage=np.zeros(0, np.float32),
                cell_temperature=np.zeros(0, np.float32), location="", serial_number="",
            )  # fmt: skip
            odom.publish(
                header=header(stamp, "odom"), child_frame_id="base_footprint",
                pose=make["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=unknown),
                twist=make["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=unknown),
            )  # fmt: skip
        print(x, y, heading, flush=True)
    for each in (odom, scan, battery, orders):
        each.close()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:6])
